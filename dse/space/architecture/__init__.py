"""The architecture of a problem: sections of the file to components, slots, connections and flows.

Read `components.py` first; `space/build.py` calls this folder in order.

* `components.py`, `segments.py`: threads, devices and connections; threads whose work is a sequence of pieces.
* `processors.py`, `buses.py`: slots, their types and figures.
* `carriers.py`, `frames.py`: buses that may carry a message; bits of a message on the wire.
* `arbitration.py`: whether messages wait for each other on a bus.
* `executors.py`: executors and reservations.
* `calls.py`: calls that are answered, as jobs that requests and replies dispatch.
* `chains.py`: threads in a row in a flow that may be one chain on a core.
* `activation.py`: components that dispatch each other.
* `joins.py`: threads that need a message of each of their triggers.
* `clocks.py`: clocks, offsets, and the moment at which data pass.
* `flows.py`, `budgets.py`: end-to-end flows; stated budgets of processors and memories (OSATE).

Not allowed here: stopping at a mistake. A mistake goes to the `Ledger` with its place, and building goes on.
"""
