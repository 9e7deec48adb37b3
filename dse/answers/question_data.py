"""The question and the problem as answers state them: settings, objectives, files, identification."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, TypeAlias, get_type_hints

from dse.space.question.settings import SETTINGS
from dse.support.json_fields import Data, Json, Of, Unit
from dse.support.version import SEMANTICS

Sense: TypeAlias = Literal["minimise", "maximise"]


class Settings(Data):
    """The settings with which the question was read."""

    profile: Annotated[Literal["dse", "osate-2.2", "osate-2.19"], "The latency rules that were applied."]
    worst_case: Annotated[Literal["execution_time", "deadline"], "OSATE's worst-case setting."]
    system: Annotated[
        Literal["asynchronous", "synchronous"], "OSATE's setting for ends that may or may not share a clock."
    ]
    partition_output: Annotated[
        Literal["major_frame", "partition_end"], "OSATE's setting for when output leaves a partition."
    ]
    best_case: Annotated[Literal["empty_queue", "full_queue"], "OSATE's setting for queues."]
    bus_queuing: Annotated[Literal["counted", "not_counted"], "OSATE's setting for buses."]
    processing: Annotated[Literal["execution_time", "response_time"], "What a flow counts for a thread."]
    deadlines: Annotated[Literal["stated", "all", "none"], "Which deadlines count."]
    overload: Annotated[
        Literal["forbidden", "allowed"], "Whether a load of more than 100 % of cores and buses is allowed."
    ]


OF_SPACE = tuple(Of(f"space.{name}", kind=get_type_hints(Settings, include_extras=True)[name]) for name in SETTINGS)
"""The settings of an answer that has a `space`."""


class Objective(Data):
    """An objective of the question."""

    name: Annotated[str, "The metric."]
    sense: Annotated[Sense, "Whether less or more of it is better."]
    unit: Annotated[Unit, "Unit of the objective: `ns`, `ct` (cents), `ppm`, or a part of one such as `1/3 ppm`."]


class Include(Data):
    """A file that the problem includes."""

    file: Annotated[str, "Path of the file, relative to the folder of the problem file."]
    sha256: Annotated[str, "The SHA-256 of its content."]


class StudiedProblem(Settings):
    """A problem as a study names it."""

    WRITTEN = ("name", "sha256", *SETTINGS, "currency")

    name: Annotated[str, "The name that the problem gives itself."]
    sha256: Annotated[str, "The SHA-256 of its file."]
    currency: Annotated[str, "The currency of prices, which count in cents."]


WAITING = "The resources for which latencies count waiting."


class WaitingCounted(Data):
    """The resources for which latencies count waiting, and those for which they do not."""

    JSON_NAME = "Waiting"

    counted: Annotated[list[str], "`processors`, and the buses by name, for which waiting is counted."]
    not_counted: Annotated[list[str], "`processors`, and the physical buses with messages, for which it is not."]
    faults: Annotated[list[str], "The buses whose faults are counted in what messages wait."]


BY_WAITING = (
    "False where there is no design even if each response time were as long as the job takes alone; true where it "
    "takes that threads wait for each other, as far as is known."
)


class AskedQuestion(Settings):
    """The question as it was really asked: that of the file, with what the command line or a caller added."""

    JSON_NAME = "Question"
    WRITTEN = ("requirements", "implied", "rules", "objectives", "fixed", *SETTINGS, "robust")

    requirements: Annotated[list[str], "The requirements, in the order of the file; then those that were added."]
    implied: Annotated[
        list[str], "The limits that are not stated, but implied: 100 % of cores, bandwidths and exclusive buses."
    ]
    rules: Annotated[list[str], "The rules, in the order of the file; then those that were added."]
    objectives: Annotated[list[str], "The objectives with their senses, such as `minimise price`."]
    fixed: Annotated[Mapping[str, str], "The decisions that were fixed, each with its option."]
    robust: Annotated[bool, "Whether every requirement had to hold for all values that `uncertainty` states."]


@dataclass(frozen=True)
class Origin:
    """The solved problem: name, file, hashes, and the complete question.

    `identity` is described in `dse.spec.loading.document`; `texts` are the files of the problem by name, as found from
    the folder of the main one, so that a result can be worked with where they are not. `is_carried`: so it was here.
    """

    name: Annotated[str, "The name that the problem gives itself."]
    file: Annotated[str, "The path of its file, as it was given."]
    sha256: Annotated[str, "The SHA-256 of the file."]
    includes: Sequence[tuple[str, str]]
    effective: Annotated[Mapping[str, Any], "The question as it was asked.", Json(kind=AskedQuestion)]
    identity: Annotated[str, "A digest of what the problem means, the same whatever its layout and comments."] = ""
    texts: Mapping[str, str] = field(default_factory=dict, repr=False)
    is_carried: bool = False

    @property
    def included(self) -> Annotated[list[Mapping[str, str]], Json("includes", kind=list[Include])]:
        """The files that it includes."""
        return [{"file": name, "sha256": digest} for name, digest in self.includes]

    @property
    def question(self) -> str:
        """A digest of meaning and question together; regions belong to one of them only.

        It is made of what the figures mean, what the problem means, and what was asked of it.
        """
        parts = [SEMANTICS, self.identity, dict(self.effective)]
        return hashlib.sha256(json.dumps(parts, ensure_ascii=False, sort_keys=True).encode()).hexdigest()


class ExplainedProblem(Data):
    """The explained problem, and its question."""

    OF = Origin
    WRITTEN = ("name", "file", "sha256", "included", "effective")


class SolvedProblem(Data):
    """The solved problem, and its question."""

    OF = Origin
    WRITTEN = (
        *("name", Of("file", limits={"pattern": r"^[^\x00]*$"}), "sha256", "included", "identity", "effective"),
        "question",
    )
