"""Problem files to a `Spec`: reads includes, validates every file, merges them, reports all findings at once."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from dse.importers.registry import IMPORTERS, is_model, read_foreign
from dse.spec.loading.document import SECTIONS, identity_of, merged_document
from dse.spec.loading.foreign import offered, overlaid, strangers, tree_of
from dse.spec.loading.messages import CARRIED, Sized, read_sizes, with_sizes
from dse.spec.loading.partial_reading import WHOLE, Place, Remains, remains, salvaged
from dse.spec.loading.reader import MAX_BYTES, PathPart, RepeatedKeysError, Source, YamlNode, decode_text, read_yaml
from dse.spec.loading.recognition import no_answer, of_another_format
from dse.spec.loading.samples import Samples, read_samples
from dse.spec.loading.sources import Carried, Files, OnDisk, name_from, read_source
from dse.spec.loading.validation_messages import is_of_wrong_items, translated
from dse.spec.loading.writing import block_text
from dse.spec.quantities.totals import in_declared_units
from dse.spec.schema.model import Catalogue, Spec
from dse.spec.schema.uncertainty import UncertainInput, UncertaintyError, read_stated
from dse.support.errors import Diagnostic, ProblemError, in_order

MAX_FILES = 200


@dataclass(frozen=True)
class LoadedSpec:
    """A problem with its includes merged in, and where it was read.

    `sha256` is that of the main file; `includes` has each included file, as found from the main file's folder, and
    its hash. `texts` are those of all its files, the main one's under its own name; `samples` what stated
    uncertainties take from files, `sized` the sizes of connections that name a message. `is_carried`: it was not
    read from the disk, but from such texts. `remains` tells what was taken out of a problem with mistakes. `told`
    is what the import of a model has left out or not understood.
    """

    spec: Spec
    path: Path
    sha256: str
    includes: tuple[tuple[str, str], ...] = ()
    sources: tuple[Source, ...] = field(default=(), repr=False, compare=False)
    remains: Remains = WHOLE
    texts: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)
    samples: Samples = field(default_factory=dict, repr=False, compare=False)
    sized: Sized = field(default_factory=Sized, repr=False, compare=False)
    is_carried: bool = False
    told: tuple[Diagnostic, ...] = ()

    @cached_property
    def document(self) -> Mapping[str, Any]:
        """The problem as plain data, with includes and samples merged in.

        Keys and values as a problem file has them, JSON-compatible. Computed once.
        """
        return merged_document([source.node for source in self.sources], self.samples, self.sized.sizes)

    @cached_property
    def _uncertainties(self) -> tuple[tuple[UncertainInput, ...], tuple[UncertaintyError, ...]]:
        return read_stated(self.spec, self.samples)

    @property
    def stated(self) -> tuple[UncertainInput, ...]:
        """The uncertain inputs of the problem, in the order of the file; entries with mistakes are left out.

        Inputs of robust fronts and of sampling, each with its paths and its range or distribution.
        """
        return self._uncertainties[0]

    @property
    def misstated(self) -> tuple[UncertaintyError, ...]:
        """The mistakes in what it says of its figures' uncertainty.

        Reported when a study needs the uncertainties; a plain solve does not fail for them.
        """
        return self._uncertainties[1]

    @cached_property
    def identity(self) -> str:
        """The digest of what it means: that of all problems which differ in comments, layout and paths only.

        SHA-256 in hexadecimal (`identity_of`). Results carry it, so that a changed problem is noticed.
        """
        return identity_of(self.document)

    def diagnostic(
        self,
        path: Sequence[PathPart],
        message: str,
        hint: str = "",
        severity: Literal["error", "warning"] = "error",
        *,
        at_key: bool = False,
    ) -> Diagnostic:
        """A finding about a place such as ``("threads", "nav", "period")``, in the file that has most of that path.

        With `at_key` the place is that of the key instead of the value.
        """
        return self.source_of(path).diagnostic(path, message, hint, severity, at_key=at_key)

    def source_of(self, path: Sequence[PathPart]) -> Source:
        """The file that states the longest part of a path.

        A path that no file has completely belongs to the file with its longest beginning.
        """
        return max(self.sources, key=lambda candidate: len(candidate.node.known(path)))


class UnreadableError(ProblemError):
    """Parts of the problem cannot be read; `rest` is the problem without them, None where too much is missing.

    Later steps check `rest`, so that one run reports mistakes of form and of names together.
    """

    def __init__(self, diagnostics: Sequence[Diagnostic], rest: LoadedSpec | None) -> None:
        super().__init__(diagnostics)
        self.rest = rest


def load_spec(
    path: Path, texts: Mapping[str, str] | None = None, options: Mapping[str, str] | None = None
) -> LoadedSpec:
    """Read a problem file with everything it includes; from `texts`, as `LoadedSpec` has them, where they are given.

    `path` may be a model (`dse.importers`), which is imported with `options`.

    Raises
    ------
    UnreadableError
        All findings in all files, main file first, then in the order of inclusion, by line. Names are not looked up.
    """
    loader = _SpecLoader(path, OnDisk() if texts is None else Carried(path, texts), options or {})
    if texts is None and is_model(path):
        loader.take_model(path)
    else:
        loader.read(path, str(path), Spec, ())
    return loader.result()


def parse_spec(text: str, file: str = "<text>") -> LoadedSpec:
    """Read a problem from text that includes no files; `file` is its name in diagnostics.

    Raises
    ------
    UnreadableError
        All findings, by line.
    """
    loader = _SpecLoader(Path(file))
    loader.is_text = True
    loader.take(text, file, Spec, text.encode("utf-8", "replace"))
    if loader.parts and loader.parts[0].source.node.known(["include"]):
        loader.miss(loader.parts[0].source.diagnostic(["include"], "a text cannot include files"))
    return loader.result()


@dataclass(frozen=True)
class _FileRead:
    """One file that was read; where it has errors `model` is the rest, if any, without what was at `lost`."""

    source: Source
    sha256: str
    model: Catalogue | None
    text: str
    lost: tuple[Place, ...] = ()


class _SpecLoader:
    """Collects the files of one problem and the findings about them."""

    def __init__(self, main: Path, files: Files | None = None, options: Mapping[str, str] | None = None) -> None:
        self.main = main
        self.options = dict(options or {})
        self.models: dict[str, str] = {}
        self.told: list[Diagnostic] = []
        self.is_text = False
        self.files: Files = OnDisk() if files is None else files
        self.parts: list[_FileRead] = []
        self.findings: list[Diagnostic] = []
        self._files: list[str] = []
        self._seen: set[Path] = set()
        self._is_complete = True

    def read(self, path: Path, file: str, model: type[Catalogue], including: tuple[Path, ...]) -> None:
        """Read one file and what it includes; `including` are the files on the way here."""
        self._seen.add(self.files.real(path))
        self._files.append(file)
        try:
            what = "an included file" if including else "the problem file"
            data = read_source(self.files, path, file, MAX_BYTES, what)
            text = decode_text(data, file)
        except ProblemError as error:
            self._is_complete = False
            self.findings += error.diagnostics
            return
        if model is Spec and isinstance(self.files, OnDisk) and (foreign := of_another_format(path, text)):
            self.miss(foreign)
            return
        source = self.take(text, file, model, data)
        if source is not None:
            for place, target in _includes(source.node):
                self._include(source, place, path.parent / target, (*including, self.files.real(path)))

    def take(self, text: str, file: str, model: type[Catalogue], data: bytes) -> Source | None:
        """Validate one text, which was `data` in the file; its tree, or None when it has no tree."""
        if file not in self._files:
            self._files.append(file)
        lost: tuple[Place, ...] = ()
        try:
            source = Source(file, no_answer(read_yaml(text, file), file))
        except RepeatedKeysError as error:
            self.findings += error.diagnostics
            source, lost = Source(file, error.root), error.paths
            self._is_complete &= all(len(path) > 2 for path in lost)  # else the second may be what others name
        except ProblemError as error:
            self._is_complete = False
            self.findings += error.diagnostics
            return None
        if model is Spec and isinstance(source.node.value, dict) and source.text_at(["of"]):
            source = self._with_model(source)
        valid: Catalogue | None = None
        try:
            valid = model.model_validate(source.node.to_data())
        except ValidationError as error:
            self._note(error, source, model)
            if rest := salvaged(model, source.node.to_data(), error):
                valid, lost = rest[0], (*lost, *rest[1])
        self.parts.append(
            _FileRead(source, hashlib.sha256(data).hexdigest(), valid, data.decode(errors="replace"), lost)
        )
        return source

    def take_model(self, path: Path) -> None:
        """The problem that a model states by itself."""
        try:
            imported = read_foreign(path, None, self.options)
        except ProblemError as error:
            self._is_complete = False
            self.findings += error.diagnostics
            return
        self.told += imported.remarks
        self._files += dict.fromkeys(place.file for place in imported.places.values())
        source = Source(str(path), tree_of(imported, str(path)))
        text = block_text(imported.document)
        try:
            valid: Catalogue | None = Spec.model_validate(source.node.to_data())
        except ValidationError as error:
            self._note(error, source, Spec)
            valid = None
        digest = hashlib.sha256(text.encode()).hexdigest()
        self.parts.append(_FileRead(source, digest, valid, text))

    def _with_model(self, source: Source) -> Source:
        """A file that decides over a model, laid over what that states."""
        try:
            model = self.models_of(source)
        except ProblemError as error:
            self._is_complete = False
            self.findings += error.diagnostics
            return source
        wrong = list(strangers(source.node, model, source.file))
        self.findings += wrong
        self._is_complete &= not wrong
        return Source(source.file, overlaid(source.node, model))

    def models_of(self, source: Source) -> YamlNode:
        """The tree of the model that a file decides over."""
        if self.is_text:
            raise ProblemError([source.diagnostic(["of"], "a text cannot decide over a model, which is a file")])
        name = source.text_at(["of"])
        target = self.main.parent / name
        if isinstance(self.files, Carried):
            text = decode_text(read_source(self.files, target, name, MAX_BYTES, "a model"), name)
            self.models[name] = text
            return read_yaml(text, name)
        if not is_model(target):
            hint = f"one of the formats {', '.join(item.name for item in IMPORTERS if item.is_problem)}"
            raise ProblemError([source.diagnostic(["of"], "expected the path of a model", hint)])
        if (missing := None if target.is_dir() else self.files.obstacle(target)) is not None:
            hint = "the path is relative to this file"
            raise ProblemError([source.diagnostic(["of"], f"{missing}: {str(target)!r}"[:300], hint)])
        options: dict[str, Any] = {key: source.text_at([key]) for key in ("root", "mode") if source.text_at([key])}
        if folders := self._libraries(source):
            options["library"] = folders
        imported = read_foreign(target, None, {**options, **self.options, "choices": offered(source.node)})
        self.told += imported.remarks
        self._files += dict.fromkeys(place.file for place in imported.places.values())
        self.models[name] = block_text(imported.document)
        return tree_of(imported, str(target))

    def _libraries(self, source: Source) -> list[str]:
        """The folders of libraries that a file names, each of which must be there."""
        stated = source.node.to_data()
        listed = stated.get("library") if isinstance(stated, dict) else None
        folders = [listed] if isinstance(listed, str) else listed if isinstance(listed, list) else []
        paths = []
        for name in (item for item in folders if isinstance(item, str)):
            folder = self.main.parent / name
            if not folder.is_dir():
                hint = "the path is relative to this file"
                raise ProblemError([source.diagnostic(["library"], f"there is no folder {name!r}"[:300], hint)])
            paths.append(str(folder))
        return paths

    def _note(self, error: ValidationError, source: Source, model: type[Catalogue]) -> None:
        errors = error.errors(include_url=False)
        self.findings += [translated(item, source, model) for item in errors if not is_of_wrong_items(item)]

    def _include(self, source: Source, place: Sequence[PathPart], target: Path, including: tuple[Path, ...]) -> None:
        missing, resolved = self.files.obstacle(target), self.files.real(target)
        if resolved in including:
            self.miss(source.diagnostic(place, f'"{target.name}" includes itself'))
        elif missing is not None:
            hint = "the path is relative to this file"
            self.miss(source.diagnostic(place, f"{missing}: {str(target)!r}"[:300], hint))
        elif len(self._seen) >= MAX_FILES:
            self.miss(source.diagnostic(place, f"more than {MAX_FILES} files"))
        elif resolved not in self._seen:
            self.read(target, str(target), Catalogue, including)

    def miss(self, finding: Diagnostic) -> None:
        """Note a mistake that leaves unknown which names there are."""
        self._is_complete = False
        self.findings.append(finding)

    def result(self) -> LoadedSpec:
        """The merged problem; raises when there are findings."""
        self._check_repeated_names()
        can_merge = self._is_complete and all(part.model is not None for part in self.parts)
        loaded = self._merge() if can_merge else None
        if loaded is not None:
            self.findings += [loaded.diagnostic(item.path, item.message, item.hint) for item in loaded.sized.mistakes]
        if self.findings:
            raise UnreadableError(in_order(self.findings, self._files), self._rest(loaded))
        assert loaded is not None
        return loaded

    def _rest(self, loaded: LoadedSpec | None) -> LoadedSpec | None:
        """The problem without what is wrong."""
        if loaded is None:
            return None
        lost = [place for part in self.parts for place in part.lost]
        lost += [(*item.path[:2], "data_size") for item in loaded.sized.mistakes if item.path[0] == "connections"]
        if any(item.path[0] == "messages" for item in loaded.sized.mistakes):
            lost += [("connections", name, "data_size") for name in loaded.spec.connections]
        return replace(loaded, remains=remains(loaded.spec, lost))

    def _merge(self) -> LoadedSpec:
        main, *others = self.parts
        assert isinstance(main.model, Spec)
        spec = in_declared_units(main.model.model_copy(update=self._merged()) if others else main.model)
        names = [name_from(part.source.file, self.main) for part in others]
        samples, texts = read_samples(spec, self.main, self.files)
        texts |= dict(zip((self.main.name, *names), (part.text for part in self.parts), strict=True))
        texts |= self.models
        lost = {str(place[1]) for part in self.parts for place in part.lost if place[0] == "connections" and place[1:]}
        sized = read_sizes(spec, self.main, self.files, is_text=self.is_text, doubtful=lost)
        if sized.sizes:
            texts[CARRIED] = sized.text
        models = tuple((name, hashlib.sha256(text.encode()).hexdigest()) for name, text in self.models.items())
        return LoadedSpec(
            with_sizes(spec, sized),
            self.main,
            main.sha256,
            includes=(*models, *zip(names, (part.sha256 for part in others), strict=True)),
            sources=tuple(part.source for part in self.parts),
            texts=texts,
            samples=samples,
            sized=sized,
            is_carried=isinstance(self.files, Carried),
            told=tuple(self.told),
        )

    def _merged(self) -> dict[str, Any]:
        models = [part.model for part in self.parts if part.model is not None]
        merged: dict[str, Any] = {
            section: {name: value for model in models for name, value in getattr(model, section).items()}
            for section in SECTIONS
        }
        merged["assumptions"] = tuple(text for model in models for text in model.assumptions)
        return merged

    def _check_repeated_names(self) -> None:
        for section in SECTIONS:
            first: dict[str, Source] = {}
            for part in self.parts:
                for name in _names(part.source.node, section):
                    other = first.setdefault(name, part.source)
                    if other is not part.source:
                        line, column = other.node.locate((section, name), at_key=True)
                        message = f'"{name}" is defined twice, first in {other.file}:{line}:{column}'
                        self.miss(part.source.diagnostic((section, name), message, at_key=True))


def _names(node: YamlNode, section: str) -> list[str]:
    entry = node.value.get(section) if isinstance(node.value, dict) else None
    return list(entry.node.value) if entry and isinstance(entry.node.value, dict) else []


def _includes(node: YamlNode) -> Iterator[tuple[tuple[PathPart, ...], str]]:
    """Place and text of each path that `include` names, also in a file that has errors elsewhere."""
    entry = node.value.get("include") if isinstance(node.value, dict) else None
    if entry is None:
        return
    if isinstance(entry.node.value, str):
        yield ("include",), entry.node.value
    elif isinstance(entry.node.value, tuple):
        for at, item in enumerate(entry.node.value):
            if isinstance(item.value, str):
                yield ("include", at), item.value
