"""Messages that wait for their bus (docs/semantics.md, section 5.4).

Read `stages.py` first.

* `stages.py`: which bus a message waits for, what releases it, and in which order messages go; as stages on a resource.
* `frames.py`: what each connection adds to a message that it may be carried in.
* `assignment.py`: the places of messages that may have any identifier (Audsley).
* `burdens.py`: options that keep a bus busier.
* `conflicts.py`: messages of which none can be the last in time, whatever their order.
* `precedence.py`: messages that go before another one in any order in which all are in time.
* `late.py`: why a message is late, and the identifier that would do.
* `waits.py`: the response times of the messages of a bus, and what each waits for.

The theory is in `analysis/scheduling`, a policy of a resource as others (`policies/buses.py`). Not allowed here: a
guess. A bus of which something is not stated has no waiting (`dse.space.architecture.arbitration`).
"""
