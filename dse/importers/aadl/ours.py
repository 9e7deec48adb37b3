"""The property set that holds what AADL has no word for: cores, prices, callbacks; read here, written by exports."""

from __future__ import annotations

OURS = "dse"
TEXT = """property set dse is
  -- What dse knows of an architecture and AADL has no word for; https://docs.osate.org knows all the others.
  Cores: aadlinteger applies to (processor);
  Price: aadlstring applies to (all);
  Power: aadlstring applies to (all);
  Exclusive: aadlboolean applies to (bus);
  Callback_Execution_Time: Time_Range applies to (thread);
  Name: aadlstring applies to (all);
  Type_Name: aadlstring applies to (all);
  Boundary: aadlboolean applies to (all);
  Extra: list of aadlstring applies to (all);
  Slot: list of aadlstring applies to (all);
end dse;
"""
"""Quantities are texts as in problem files, such as ``150 EUR``.

`Extra` has further fields, ``key: value`` (of a processor or bus: of its type, and `Slot` those of its own); `Name` is
what the problem file calls it, where AADL cannot. `Boundary` marks what stands for the world around the system.
"""
