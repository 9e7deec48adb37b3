"""AADL text to its syntax tree: packages, classifiers and property sets.

A parser by recursive descent, one function for each rule: its messages say what was expected at which line and column,
it goes on behind the classifier that holds a mistake, and reads about a megabyte of text in a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dse.importers.aadl.syntax.cursor import Cursor
from dse.importers.aadl.syntax.sections import (
    CATEGORIES,
    SECTIONS,
    accept_words,
    category_of,
    read_bindings,
    read_section,
)
from dse.importers.aadl.syntax.tokens import SourceText, finding
from dse.importers.aadl.syntax.tree import Classifier, Definition, Package, PropertySet, Rename, Unit, Value
from dse.importers.aadl.syntax.values import read_association, read_value
from dse.support.errors import Diagnostic, ProblemError


@dataclass(frozen=True)
class Parsed:
    """The content of a parsed file, with remarks on doubtful places and with its mistakes."""

    unit: Unit
    remarks: Sequence[Diagnostic] = ()
    findings: Sequence[Diagnostic] = ()


def parse(text: str, file: str) -> Parsed:
    """The syntax tree of a text; `file` is its name in findings.

    Examples
    --------
    >>> parsed = parse("package p public device gnss end gnss; end p;", "p.aadl")
    >>> [item.name for item in parsed.unit.packages[0].classifiers.values()]
    ['gnss']
    >>> print(parse("package p public device gnss is end gnss; end p;", "p.aadl").findings[0])
    p.aadl:1:30: expected features, flows, modes, properties or "end", got "is"
    """
    source = SourceText(file, text)
    try:
        parser = _Parser(Cursor(source))
    except ProblemError as error:
        return Parsed(Unit(), (), error.diagnostics)
    try:
        parser.read()
    except ProblemError as error:
        parser.findings += error.diagnostics
    except RecursionError:
        parser.findings.append(finding("nested too deeply", parser.cursor.place))
    return Parsed(parser.unit, parser.cursor.remarks, parser.findings)


class _Parser:
    """Reads one file."""

    def __init__(self, cursor: Cursor) -> None:
        self.cursor = cursor
        self.unit = Unit()
        self.findings: list[Diagnostic] = []

    def read(self) -> None:
        """Everything up to the end of the file."""
        cursor = self.cursor
        loose: Package | None = None
        while cursor.token.kind != "end":
            if cursor.sees("package"):
                self._package()
            elif cursor.sees("property", "set"):
                self._property_set()
            elif self._begins_classifier():
                if loose is None:
                    name = cursor.text.file.rpartition("/")[2].rpartition("\\")[2].partition(".")[0]
                    loose = Package(name, cursor.place)
                    self.unit.packages.append(loose)
                    cursor.remark(f'stands in no package: read as if in "package {name}"', cursor.place)
                self._classifier(loose)
            else:
                cursor.fail('"package", "property set" or a classifier')

    def _begins_classifier(self) -> bool:
        cursor = self.cursor
        return any(cursor.sees(*text.split()) for text in (*CATEGORIES, "feature group"))

    def _package(self) -> None:
        cursor = self.cursor
        cursor.expect("package")
        package = Package("::".join(cursor.qualified("the name of the package")), cursor.place)
        self.unit.packages.append(package)
        if not (cursor.sees("public") or cursor.sees("private")):
            cursor.fail('"public" or "private"')
        while not cursor.sees("end"):
            if cursor.accept("public") or cursor.accept("private"):
                continue
            if cursor.accept("with"):
                self._with(package)
            elif cursor.sees("annex"):
                _skip_annex(cursor)
            elif cursor.accept("properties"):
                while not cursor.accept("none", ";") and not cursor.sees("end"):
                    package.properties.append(read_association(cursor))
            elif cursor.sees("renames") or cursor.ahead().key == "renames":
                self._rename(package)
            elif self._begins_classifier():
                self._classifier(package)
            else:
                cursor.fail('a classifier, "with", "renames", "annex", "private" or "end"')
        self._end(package.name)

    def _end(self, name: str) -> None:
        """``end name;``: the name must be that of the beginning."""
        cursor = self.cursor
        cursor.expect("end")
        if cursor.token.kind == "name":
            start = cursor.place
            end_name = "::".join(cursor.qualified("a name"))
            if cursor.accept("."):
                end_name += f".{cursor.name()}"
            if end_name.lower() != name.lower():
                cursor.remark(f'expected "end {name};", got "end {end_name};"', start)
        else:
            cursor.fail(f'"{name}"')
        cursor.expect(";")

    def _with(self, package: Package) -> None:
        cursor = self.cursor
        while True:
            place = cursor.place
            package.withs.append(("::".join(cursor.qualified("the name of a package or property set")), place))
            if not cursor.accept(","):
                break
        cursor.expect(";", 'a comma or ";"')

    def _rename(self, package: Package) -> None:
        cursor = self.cursor
        alias = "" if cursor.sees("renames") else cursor.name()
        cursor.expect("renames")
        if cursor.accept("package"):
            package.renames.append(Rename(alias, "::".join(cursor.qualified("the name of a package")), ""))
        else:
            if not category_of(cursor):
                cursor.accept("feature", "group")
            *names, last = cursor.qualified("the name of a classifier")
            package.renames.append(Rename(alias or last, "::".join(names), last))
        cursor.expect(";")

    def _classifier(self, package: Package) -> None:
        """One classifier; behind a mistake in it reading goes on with the next."""
        start = self.cursor.at
        try:
            classifier = self._read_classifier(package)
        except ProblemError as error:
            self.findings += error.diagnostics
            if not self._recover(start):
                raise _Again from None
            return
        other = package.classifiers.setdefault(classifier.name.lower(), classifier)
        if other is not classifier:
            message = f'"{classifier.name}" is declared twice in {package.name}, first in line {other.place.line}'
            self.findings.append(finding(message, classifier.place))

    def _recover(self, start: int) -> bool:
        """Move behind the ``end name;`` of the classifier that begins at `start`."""
        cursor = self.cursor
        cursor.at = max(start + 1, cursor.at)
        while cursor.token.kind != "end":
            if cursor.sees("end") and cursor.ahead().kind == "name" and cursor.ahead().key != "to":
                cursor.at += 2
                while cursor.token.key in (".", "::"):
                    cursor.at += 2
                if cursor.accept(";"):
                    return True
            else:
                cursor.take()
        return False

    def _read_classifier(self, package: Package) -> Classifier:
        cursor = self.cursor
        category = "feature group" if cursor.accept("feature", "group") else category_of(cursor)
        implementation = cursor.accept("implementation")
        place = cursor.place
        name = cursor.name(f"the name of the {category}")
        if implementation:
            cursor.expect(".", '"." and the name of the implementation')
            name = f"{name}.{cursor.name('the name of the implementation')}"
        classifier = Classifier(category, name, place, package.name)
        classifier.bindings = read_bindings(cursor)
        if cursor.accept("extends"):
            classifier.extends = cursor.reference()
            classifier.bindings = (*classifier.bindings, *read_bindings(cursor))
        allowed = _sections(category, implementation)
        while not cursor.sees("end"):
            if cursor.sees("annex"):
                _skip_annex(cursor)
            elif category == "feature group" and cursor.accept("inverse"):
                cursor.expect("of")
                classifier.inverse_of = cursor.reference()
            elif section := accept_words(cursor, allowed):
                read_section(cursor, section, classifier)
            else:
                shown = [item for item in allowed if item not in ("requires modes", "prototypes", "calls")]
                shown = [item for item in shown if item == "features" or "feature" not in item]
                cursor.fail(f'{", ".join(shown)} or "end"')
        self._end(name)
        return classifier

    def _property_set(self) -> None:
        cursor = self.cursor
        cursor.at += 2
        place = cursor.place
        property_set = PropertySet(cursor.name("the name of the property set"), place)
        self.unit.sets.append(property_set)
        cursor.expect("is")
        while cursor.accept("with"):
            cursor.skip(";")
            cursor.expect(";")
        while not cursor.sees("end") or cursor.ahead().key == ":":
            definition = self._definition()
            property_set.definitions[definition.name.lower()] = definition
        self._end(property_set.name)

    def _definition(self) -> Definition:
        cursor = self.cursor
        place = cursor.place
        name = cursor.name('a property, a constant, a type or "end"')
        cursor.expect(":")
        if cursor.accept("type"):
            cursor.skip(";")
            cursor.expect(";")
            return Definition(name, "type", False, None, place)
        kind = "constant" if cursor.accept("constant") else "property"
        inherit = cursor.accept("inherit")
        value: Value | None = None
        cursor.skip("=>", "applies", ";")
        if cursor.accept("=>"):
            value = read_value(cursor)
        cursor.skip(";")
        cursor.expect(";")
        return Definition(name, kind, inherit, value, place)


class _Again(ProblemError):
    """The rest of the file cannot be read: what is wrong is among the findings already."""

    def __init__(self) -> None:
        super().__init__([])


def _sections(category: str, implementation: bool) -> tuple[str, ...]:
    if category == "feature group":
        return ("prototypes", "features", "properties")
    if not implementation:
        return ("prototypes", "features", "flows", "modes", "requires modes", "properties")
    return tuple(item for item in SECTIONS if item not in ("features", "requires modes"))


def _skip_annex(cursor: Cursor) -> None:
    cursor.expect("annex")
    cursor.qualified("the name of the annex")
    if cursor.token.kind == "annex":
        cursor.take()
    elif not cursor.accept("none"):
        cursor.fail('"{**" or "none"')
    if cursor.accept("in", "modes"):
        cursor.names("the name of a mode")
    cursor.expect(";")
