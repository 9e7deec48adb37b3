"""Messages that wait for buses in the second proof.

Read `limits.py` first. What `encode/messages` has, too, has the same file name there, and shares no code.

* `limits.py`: limits on the response times of messages, learned from refused solutions.
* `rows.py`: what the messages due by some time need of a bus, whatever their order.
* `waiting.py`: how long each message waits at least, and behind whom.
* `reasons.py`: lessons from a message that is late or waits so long in a design.

Not allowed here: an import of `encode` or `search`, and a formula of a response time (`dse.analysis.messages`).
"""
