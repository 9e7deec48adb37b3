"""Sentences and tables about one subject, which pages of several verbs share.

Read `reasons.py` first.

* `headline.py`, `choice.py`: the first lines of an answer; the recommendation, in words that tell designs apart.
* `reasons.py`: the reasons for an alternative.
* `contention.py`, `scheduling.py`, `lateness.py`: CPU contention; response-time tables and Gantt charts; late threads
  and overloads.
* `messages.py`: tables of messages that wait for their bus.
* `clocks.py`: timers on one clock, and offsets that shorten a wait.
* `basis.py`: the rules by which figures count.
* `missing.py`: the gap of an incomplete front.
* `imported.py`: the block that an import ends with.
* `resources.py`: budgets of processors and memories (OSATE).

Not allowed here: finding a cause; `analysis/diagnosis` and `answers/ranking` do. Texts and tables without markup, in
the words of docs/glossary.md.
"""
