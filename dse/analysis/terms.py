"""The summands of a metric, and their sum: exact, for one design or for a table over many."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial, reduce
from math import ceil
from typing import Any, Literal, TypeAlias, cast

from dse.analysis.rates import RateKey, rate_hz
from dse.analysis.views import View
from dse.space.model.criteria import Metric
from dse.space.model.flows import Step
from dse.space.model.space import Space
from dse.support.units import Exact, is_unbounded, picked

PPM = 10**6
ZERO = Fraction(0)
"""Added to a figure it makes an exact rational of it, whatever kind of number that is (`dse.questions.sensitivity`)."""
SCALE_LIMIT = 10**7
"""The finest unit in which a metric is counted; finer common denominators are rounded up term by term."""


@dataclass(frozen=True)
class FlowChain:
    """Threads in a row of a flow of which each may be released by the end of the one before, the first of them first.

    It `has_source` where the flow comes to them through all that may release the first one, from a source of its own
    on: then how late they end counts from the release of that (docs/semantics.md, section 4.9). It `is_paired` where
    the first one takes messages of all its inputs in order: then it counts from its latest release (section 3.8).
    """

    threads: tuple[int, ...]
    has_source: bool = False
    is_paired: bool = False


Waiter: TypeAlias = int | FlowChain
"""Who waits for others: a thread by its number, or threads that may be one chain."""


@dataclass(frozen=True)
class Term:
    """One summand, with the thread or connection that it belongs to.

    Where it is a coefficient times a rate, both parts are there too, for the search's sake. Where it is, or holds, a
    response time, which consults whatever shares its processor, `ends` are bounds of it that consult less. Where it is
    the greatest or least of several sums, `extreme` has them. Where it depends on offsets that are open, `phased` takes
    them apart from all else.
    """

    label: str
    value: Callable[[View], Fraction]
    coefficient: Callable[[View], Fraction] | None = None
    rate: RateKey | None = None
    component: str = ""
    ends: Callable[[View], tuple[Fraction, Fraction]] | None = None
    waits: tuple[Waiter, Fraction] | None = None
    """A thread, or threads of a flow that may be one chain, and how often their waiting for others counts at least on
    top of the lower end, in every design."""
    may_fall: bool = False
    """Whether it may be less where some response time is longer: data that come later may wait less for a reader."""
    only_waits: bool = False
    """Whether that is all: the figure is the lower end, and so often the waiting."""
    waits_where: Callable[[View], bool] | None = None
    """In which designs it waits, where only some: the figure is the lower end, and there as often as `waits` says."""
    grows: bool = False
    """Whether it is never less where some response time is longer; what `waits` is so, too."""
    extreme: ExtremeOfSums | None = None
    phased: Phased | None = None
    reads: Reads | None = None
    """What it is where response times are known, if it hangs on offsets and on these."""
    message: MessageWait | None = None
    """The waiting of a message for its bus that it adds to the lower end, as far as it grows with that."""
    sampled: Sampled | None = None
    """What it is of, where an element of a flow may sample what another timer made."""

    def _rounded_up(self, view: View, scale: int) -> int:
        """The value in units of 1 / `scale`, every single figure in it rounded up."""
        if self.extreme is None:
            return ceil(self.value(view) * scale)
        extreme: int = self.extreme.pick(
            sum(term._rounded_up(view, scale) for term in terms) for terms in self.extreme.sums
        )
        return extreme


@dataclass(frozen=True)
class MessageWait:
    """How often the waiting of a connection's message for its bus counts in a figure.

    Where it `has_source` it counts from the latest time at which the message may be queued (docs/semantics.md, section
    5.4), else from when it is.
    """

    number: int
    has_source: bool = False
    times: Fraction = Fraction(1)


@dataclass(frozen=True)
class Sampled:
    """The contribution of `step` to a metric of `kind`, times `factor`, as data for formulas outside the analysis.

    The design is asked of the view that `asked` makes of a view of it.
    """

    space: Space
    step: Step
    kind: str
    factor: Fraction = Fraction(1)
    asked: Callable[[View], View] = lambda view: view

    def scaled(self, factor: Fraction) -> Sampled:
        """The summand times a constant.

        A new summand; `factor` is exact and multiplies the existing one.
        """
        return replace(self, factor=self.factor * factor)


@dataclass(frozen=True, slots=True)
class Rest:
    """`times` * max(0, (d + `shift`) mod `step` - `less`) of a difference d of offsets; all in ns.

    The time that data wait for a reader on one clock, as a function of the two offsets.
    """

    times: Fraction
    shift: Exact
    step: Exact
    less: Exact = 0


@dataclass(frozen=True)
class Phased:
    """A summand as a base and what is left of the difference of the offsets of `receiver` and `sender`.

    `parts` gives the base and each of these (`Rest`), which consult no offset; components go by number.
    """

    sender: int
    receiver: int
    parts: Callable[[View], tuple[Fraction, tuple[Rest, ...]]]

    def scaled(self, factor: Fraction) -> Phased:
        """The summand times a constant.

        A new summand whose base and rests are multiplied by `factor`, exact.
        """

        def parts(view: View) -> tuple[Fraction, tuple[Rest, ...]]:
            base, rests = self.parts(view)
            return base * factor, tuple(replace(item, times=item.times * factor) for item in rests)

        return Phased(self.sender, self.receiver, parts)

    def asked_of(self, other: Callable[[View], View]) -> Phased:
        """The summand by what another view of each design says.

        `other` maps the view of a design to the one that formulas get.
        """
        return replace(self, parts=lambda view: self.parts(other(view)))


@dataclass(frozen=True, slots=True)
class Read:
    """The wait of data until a reader on a clock reads them, in one case, without response times and offsets; in ns.

    Without a sender on its clock whose offset is known, too, they wait `base_ns`. With one, d = offset of the receiver
    - offset of the `sender`, and W for what threads wait for others on their cores: from the sender's release until
    they are read it is `base_ns` + g * k + x - y, with x = (d - `soonest_ns`) mod g for g = `step_ns`, and the least
    whole k >= 0 with g * k + x >= `spread_ns` + W of the threads in `delayed`. Where `counts_least` is set y is the
    least wait, max(0, x - W of those in `missed`), or 0 where x + W of those in `late` is g or more; else y is 0.
    """

    base_ns: Exact
    sender: int | None = None
    step_ns: Exact = 1
    soonest_ns: Exact = 0
    spread_ns: Exact = 0
    delayed: tuple[int, ...] = ()
    late: tuple[int, ...] = ()
    missed: tuple[int, ...] = ()
    counts_least: bool = False


@dataclass(frozen=True)
class Reads:
    """A summand of a flow as what its component `receiver` waits for until it reads, and its job; times `factor`.

    `until_read` is the first in a design, `parts` the same but for response times and offsets, which consults neither
    offsets nor cores; `job` is the other, None where only the read counts. `before` is how many summands of the flow
    come before this one.
    """

    receiver: int
    before: int
    parts: Callable[[View], Read]
    until_read: Callable[[View], Fraction]
    job: Term | None
    factor: Fraction = Fraction(1)

    def scaled(self, factor: Fraction) -> Reads | None:
        """The summand times a constant; None where it is negative, so that nothing is told at least.

        A new summand; the delay until the read and the job's time are multiplied by `factor`.
        """
        if factor <= 0:
            return None
        job = None if self.job is None else scaled_term(self.job, factor)
        return Reads(
            self.receiver,
            self.before,
            self.parts,
            lambda view: self.until_read(view) * factor,
            job,
            self.factor * factor,
        )


Kind: TypeAlias = Literal["max", "min"]


@dataclass(frozen=True)
class ExtremeOfSums:
    """The greatest (`kind` ``max``) or the least (``min``) of several sums of terms.

    Each sum is a tuple of terms; the extreme is itself the summand of a metric.
    """

    kind: Kind
    sums: tuple[tuple[Term, ...], ...]

    def pick(self, values: Iterable[Any]) -> Any:
        """The value that counts; traced numbers (`dse.questions.sensitivity`) remember how it was made, too.

        The maximum or minimum of `values`, according to `kind`.
        """
        return reduce(partial(picked, self.kind), values)

    def changed(self, change: Callable[[Term], Term], kind: Kind | None = None) -> ExtremeOfSums:
        """The extreme with every term changed; of another kind where one is given.

        A new extreme; used to scale and to negate.
        """
        return ExtremeOfSums(kind or self.kind, tuple(tuple(change(term) for term in terms) for terms in self.sums))


@dataclass(frozen=True)
class Measure:
    """A metric of a space: `value` in `unit`, `integer` in units of 1 / `scale` (exact unless `rounded`).

    Terms are in `unit`. A measure is rounded where the common denominator of its terms would be too large for the
    solver.
    """

    metric: Metric
    unit: str
    terms: tuple[Term, ...]
    scale: int = 1
    rounded: bool = False

    def value(self, view: View) -> Fraction:
        """The exact value in `unit`.

        A `Fraction`; raises `NotOffered` for a design that is not valid.
        """
        return exact_sum(term.value(view) for term in self.terms)

    def integer(self, view: View) -> int:
        """The value in units of 1 / `scale`; when `rounded`, each term is rounded up (demand).

        What the solver counts. Rounding each term up keeps the sum safe for upper limits.
        """
        if self.rounded:
            return sum(term._rounded_up(view, self.scale) for term in self.terms)
        return self.counted(self.value(view))

    def counted(self, value: int | Fraction) -> int:
        """A value in `unit` in units of 1 / `scale`.

        An integer; the value must be a multiple of 1 / `scale`, which is asserted.
        """
        total = value * self.scale
        assert total.denominator == 1, f"{self.metric.name}: {total} is no integer"
        return cast(int, total) if is_unbounded(total) else int(total)

    @property
    def counting_unit(self) -> str:
        """The unit of `integer`: ``ppm``, or ``1/3 ppm``.

        Text for results, which state integers with it.
        """
        return self.unit if self.scale == 1 else f"1/{self.scale} {self.unit}"


def exact_sum(values: Iterable[int | Fraction]) -> Fraction:
    """The sum, with one reduction for each denominator instead of one for each value.

    >>> exact_sum([Fraction(1, 3), Fraction(2, 3), Fraction(1, 2)])
    Fraction(3, 2)
    """
    numerators: dict[int, int] = {}
    others: list[Any] = []
    for value in values:
        if type(value) is Fraction:
            numerators[value.denominator] = numerators.get(value.denominator, 0) + value.numerator
        else:
            others.append(value)
    sums = [Fraction(above, below) for below, above in numerators.items()]
    return sums[0] if len(sums) == 1 and not others else sum((*others, *sums), ZERO)


def product_term(space: Space, label: str, coefficient: Callable[[View], Fraction], key: RateKey, of: str) -> Term:
    """A coefficient times a rate, as a summand; the rate is not asked for where the coefficient is 0.

    A `Term` in the unit of coefficient times Hz. `of` names what the rate is of.
    """

    def value(view: View) -> Fraction:
        factor = coefficient(view)
        return factor * rate_hz(space, key, view) if factor else factor

    return Term(label, value, coefficient, key, of)


def scaled_term(term: Term, factor: Fraction) -> Term:
    """The term times a constant; a negative one makes the greatest of several sums the least of the negated ones.

    A new `Term`; ends, coefficient and extreme are multiplied alike.
    """
    if term.extreme is not None:
        others: dict[Kind, Kind] = {"max": "min", "min": "max"}
        kind = others[term.extreme.kind] if factor < 0 else term.extreme.kind
        return extreme_term(term.label, term.extreme.changed(lambda inner: scaled_term(inner, factor), kind))
    coefficient, ends = term.coefficient, term.ends
    scaled = (lambda view: coefficient(view) * factor) if coefficient is not None else None

    def scaled_ends(view: View) -> tuple[Fraction, Fraction]:
        assert ends is not None
        low, high = sorted(end * factor for end in ends(view))
        return low, high

    return replace(
        term,
        value=lambda view: term.value(view) * factor,
        coefficient=scaled,
        ends=scaled_ends if ends is not None else None,
        waits=(term.waits[0], term.waits[1] * factor) if term.waits is not None and factor > 0 else None,
        grows=term.grows and factor > 0,
        message=replace(term.message, times=term.message.times * factor) if term.message and factor > 0 else None,
        phased=term.phased.scaled(factor) if term.phased is not None else None,
        reads=term.reads.scaled(factor) if term.reads is not None else None,
        sampled=term.sampled.scaled(factor) if term.sampled is not None else None,
    )


def extreme_term(label: str, extreme: ExtremeOfSums) -> Term:
    """The greatest or least of several sums, as a summand.

    A `Term` whose value is the extreme of exact sums.
    """

    def value(view: View) -> Fraction:
        extreme_value: Fraction = extreme.pick(
            [exact_sum(term.value(view) for term in terms) for terms in extreme.sums]
        )
        return extreme_value

    return Term(label, value, extreme=extreme)
