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
  By_Type: aadlboolean applies to (virtual bus);
  Position: aadlinteger applies to (thread, abstract);
  Extra: list of aadlstring applies to (all);
  Slot: list of aadlstring applies to (all);
end dse;
"""
"""Quantities are texts as in problem files, such as ``150 EUR``.

`Extra` has further fields, ``key: value`` (of a processor or bus: of its type, and `Slot` those of its own); `Name` is
what the problem file calls it, where AADL cannot. `Boundary` marks what stands for the world around the system,
`By_Type` a virtual bus that a problem uses by its type: it is there, and has a price, where something is bound to it.
`Position` is the place of a thread among all where that is not the model's: of equally urgent ones the first is ahead.
"""
