"""Messages that wait for buses in the model: limits on their response times, and why these are long.

Read `limits.py` first. What `verification/messages` has, too, has the same file name there, and shares no code.

* `limits.py`: limits on the response times of messages, learned from refused solutions.
* `rows.py`: what the messages due by some time need of a bus, whatever their order.
* `waiting.py`: how long each message waits at least, and behind whom.
* `reasons.py`: why a message waits so long in a design, and behind whom; which messages cannot all be in time.

Here alone: `capped_sums.py` (sums of work under literals that must not exceed a time) and `frames.py` (what connections
that may be carried add to a message); in the second proof both are parts of `rows.py`.

Not allowed here: a formula of a response time (`dse.analysis.messages`).
"""
