"""Messages that wait for buses in the model: limits on their response times, and why these are long.

Read `limits.py` first.

* `limits.py`: limits on the response times of messages, learned from refused solutions.
* `rows.py`: what the messages due by some time need of a bus, whatever their order; how long one waits at least.
* `capped_sums.py`: sums of work under literals that must not exceed a time.
* `frames.py`: what connections that may be carried add to a message, for these rows.
* `reasons.py`: why a message waits so long in a design, and behind whom; which messages cannot all be in time.

Not allowed here: a formula of a response time (`dse.analysis.messages`).
"""
