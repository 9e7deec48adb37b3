"""The question that a problem asks: metrics, requirements, rules, objectives and settings.

Read `reading.py` first. Problem files and command lines use these functions alike.

* `reading.py`: requirements, objectives, baseline; adds them to a space.
* `metrics.py`: ``METRIC [of NAME]`` to metrics.
* `limits.py`, `implied.py`: limits in the unit of their metric; implied limits of 100 %.
* `rules.py`: rules with names resolved.
* `settings.py`: settings such as the profile, and the deadlines that are requirements.
* `open_cores.py`, `open_priorities.py`: cores and priorities as decisions, where the question depends on them.
* `unchecked.py`: requirements on flows that the import could not follow, which nothing is proved without.

Not allowed here: computing a metric; the formulas are in `analysis`.
"""
