"""Mutated files of other formats for the commands that read them: CAN, ROS messages, bags, traces, ROS 2 YAML, AADL."""

from __future__ import annotations

import random
import shutil
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.answers.written import write_bag
from tests.importers.test_amalthea import MODEL as AMALTHEA
from tests.importers.test_autoware import FILES as DESIGN
from tests.importers.test_autoware import FORMAT as DESIGN_FORMAT
from tests.importers.test_autoware import write as write_design
from tests.importers.test_can import DBC, KCD
from tests.importers.test_drawn_flows import DrawnChain
from tests.importers.test_reading import model
from tests.importers.test_ros2 import ARCHITECTURE, CONFIGURATION
from tests.importers.test_trace import text as trace

from .harness import ROOT, Case, Outcome, run_case
from .mutations import changed_bytes, changed_lines, changed_number, changed_tokens, monstrous

SYM = """FormatVersion=6.0 // Do not edit this line!
Title="motor"
{ENUMS}
Enum=State(0="off", 1="on")
{SIGNALS}
Sig=speed unsigned 16 /u:"1/min" /f:0.5
Sig=state State 2
{SENDRECEIVE}
[Motor]
ID=123h
Len=8
CycleTime=10
Sig=speed 0
Sig=state 16
[Range]
ID=200h-203h
Type=Standard
Len=2
Mux=first 0,8 1
Var=more signed 8,8
"""
ARXML = """<?xml version="1.0" encoding="UTF-8"?>
<AUTOSAR xmlns="http://autosar.org/schema/r4.0"><AR-PACKAGES><AR-PACKAGE><SHORT-NAME>P</SHORT-NAME><ELEMENTS>
<CAN-CLUSTER><SHORT-NAME>C</SHORT-NAME><CAN-CLUSTER-VARIANTS><CAN-CLUSTER-CONDITIONAL><BAUDRATE>500000</BAUDRATE>
<PHYSICAL-CHANNELS><CAN-PHYSICAL-CHANNEL><SHORT-NAME>H</SHORT-NAME><FRAME-TRIGGERINGS><CAN-FRAME-TRIGGERING>
<SHORT-NAME>T</SHORT-NAME><FRAME-REF DEST="CAN-FRAME">/P/F</FRAME-REF>
<CAN-ADDRESSING-MODE>STANDARD</CAN-ADDRESSING-MODE><IDENTIFIER>5</IDENTIFIER></CAN-FRAME-TRIGGERING>
</FRAME-TRIGGERINGS></CAN-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS></CAN-CLUSTER-CONDITIONAL></CAN-CLUSTER-VARIANTS>
</CAN-CLUSTER>
<CAN-FRAME><SHORT-NAME>F</SHORT-NAME><FRAME-LENGTH>8</FRAME-LENGTH><PDU-TO-FRAME-MAPPINGS><PDU-TO-FRAME-MAPPING>
<SHORT-NAME>M</SHORT-NAME><PACKING-BYTE-ORDER>MOST-SIGNIFICANT-BYTE-LAST</PACKING-BYTE-ORDER>
<PDU-REF DEST="I-SIGNAL-I-PDU">/P/U</PDU-REF><START-POSITION>0</START-POSITION></PDU-TO-FRAME-MAPPING>
</PDU-TO-FRAME-MAPPINGS></CAN-FRAME>
<I-SIGNAL-I-PDU><SHORT-NAME>U</SHORT-NAME><LENGTH>8</LENGTH><I-SIGNAL-TO-PDU-MAPPINGS><I-SIGNAL-TO-I-PDU-MAPPING>
<SHORT-NAME>m</SHORT-NAME><I-SIGNAL-REF DEST="I-SIGNAL">/P/s</I-SIGNAL-REF>
<PACKING-BYTE-ORDER>MOST-SIGNIFICANT-BYTE-LAST</PACKING-BYTE-ORDER><START-POSITION>0</START-POSITION>
</I-SIGNAL-TO-I-PDU-MAPPING></I-SIGNAL-TO-PDU-MAPPINGS></I-SIGNAL-I-PDU>
<I-SIGNAL><SHORT-NAME>s</SHORT-NAME><LENGTH>16</LENGTH><SYSTEM-SIGNAL-REF DEST="SYSTEM-SIGNAL">/P/S</SYSTEM-SIGNAL-REF>
</I-SIGNAL><SYSTEM-SIGNAL><SHORT-NAME>S</SHORT-NAME></SYSTEM-SIGNAL>
</ELEMENTS></AR-PACKAGE></AR-PACKAGES></AUTOSAR>
"""
MUXED = DBC.replace(
    '"bar" Engine',
    '"bar" Engine\n SG_ m m0M : 16|2@1+ (1,0) [0|0] "" Engine\n SG_ n m1 : 18|2@1+ (1,0) [0|0] "" Engine',
)
MUXED += 'SG_MUL_VAL_ 512 n m 0-3, 5-5;\nVAL_ 291 speed 0 "off" 1 "on";\nCM_ BO_ 512 "a text";\n'
UNMARKED = MUXED.replace(" 512 ", " 5120 ") + 'VAL_ 5120 none 0 "off" 1 "on";\nSIG_VALTYPE_ 77 none : 1;\n'
MSG = """# a beam
std_msgs/Header header
uint8 NEAR=1
float32[<=4] ranges
string<=10 name
geometry_msgs/Pose[2] poses
uint8[16] key
bool[] flags
string[] words [ "a", "b" ]
"""
SRV = "int32 a\nfloat64[3] b\n---\nstring answer\nbool done true\n"
ACTION = "float64 to\n---\nbool there\n---\nfloat64 rest\n"
IDL = """module other {
  module msg {
    module Pair_Constants { const long N = 3; const unsigned long BIG = 1 << 4; const string TEXT = "a" "b"; };
    typedef sequence<long, 3> some;
    @verbatim (language="comment", text="two of them")
    struct Point { double x; double y; };
    struct Pair {
      @default (value=1) double one; // the first
      some two; sequence<string<8>, 4> three; octet four[16]; Point five; sequence<Point> seven;
    };
  };
};
"""
AADL = """package m public with SEI;
  data flag properties Data_Size => 3 bits; end flag;
  feature group pair features x : out event data port flag; y : in event port; end pair;
  processor cpu properties SEI::MIPSCapacity => 9.0 MIPS; end cpu;
  bus wire properties Period => 4 ms; end wire;
  virtual bus line properties Period => 2 ms; Data_Size => 9 bits; end line;
  subprogram job features i : in parameter flag; flows f : flow sink i; end job;
  device s features o : feature group pair[2]; flows f : flow source o {Latency => 1 ms .. 1 ms;};
    properties Period => 8 ms; Compute_Execution_Time => 1 ms .. 2 ms; end s;
  data store end store;
  thread r features i : feature group inverse of pair; a : requires data access store; flows f : flow sink i;
    properties Dispatch_Protocol => Sporadic; Deadline => 0 ms; end r;
  thread implementation r.j
    subcomponents c : subprogram job; calls main : {k : subprogram c;}; connections z : parameter i.x -> k.i;
    flows f : flow sink i -> z -> c.f;
  end r.j;
  process box features i : feature group inverse of pair[2]; flows f : flow sink i; end box;
  process implementation box.i
    subcomponents u : thread r.j; v : thread r; d : data store;
    connections a : feature group i[1] <-> u.i; b : feature group i[2] <-> v.i; e : data access d -> v.a;
    flows f : flow sink i -> a -> u.f in modes (one); f : flow sink i -> b -> v.f;
    modes one : initial mode; two : mode;
  end box.i;
  system top end top;
  system implementation top.i
    subcomponents s : device s[3]; p : process box.i[3]; q : processor cpu; w : bus wire; l : virtual bus line[2];
    connections
      c : feature group s.o <-> p.i {Connection_Set => ([src => (1); dst => (2);], [src => (3); dst => (3);]);};
    flows e : end to end flow s[1].f -> c -> p[2].f {Latency => 0 ms .. 90 ms;};
    properties
      Actual_Processor_Binding => (reference (q)) applies to p[1 .. 2], p[3].u, s;
      Actual_Connection_Binding => (reference (w)) applies to l;
      Actual_Connection_Binding => (reference (l[1]), reference (l[2]));
      Reference_Processor => classifier (cpu); Data_Size => 5 bits applies to s[1].o[2].x;
  end top.i;
end m;
"""
TOKENS = (
    *("1000000000", "999999999999", "1e999999999", "9" * 5000, "-1", "0x", "1_000_000_000", "18446744073709551615"),
    *("9223372036854775808", "1 << 99999999999", "N * N", "((((1))))", "(" * 50 + "1" + ")" * 50, "/* ", "<!-- ", "\0"),
    *("[999999999999]", "[<=999999999999]", "string<=999999999999", "SG_MUL_VAL_ 512 n m 0-4294967295;", "m0M", "007"),
    *('encoding="utf-16"', 'encoding="x"', 'encoding="hex"', "<!DOCTYPE a [<!ENTITY b 'c'>]>", "&b;", "<a>" * 500),
    *("callbacks", "unit", "wires", "timer", "vpid", "period", '"', "\\", "@1+", "|", ";", "{", "}", "h-FFFFFFFFh"),
    *("Vector__XXX", "NodeRef id='9'", "::", "sequence<", "float128", "wstring", "fixed", "\u202e", "\ud800", "\ufeff"),
)
Mutate = Callable[[str, random.Random, tuple[str, ...]], str]
_MUTATIONS: tuple[Mutate, ...] = (changed_tokens, changed_number, changed_lines, monstrous)
_NUMBERS = (0, 1, 0xFF, 0x7FFF_FFFF, 0xFFFF_FFFF, 2**40, 2**63 - 1, 2**63, 2**64 - 1)


@dataclass(frozen=True)
class Sound:
    """A file that is right: its name, what is in it, and the command that reads it (``FILE`` stands for its name)."""

    name: str
    data: bytes
    arguments: tuple[str, ...]


def sound_files(folder: Path) -> Iterator[Sound]:
    """One or two of each format; what lies beside them is put in the folder."""
    can = ("import", "FILE", "--bandwidth", "500 kbit/s", "--cycle", "10 ms", "-o", "out.yaml")
    for name, text in (
        ("a.dbc", DBC),
        ("b.dbc", MUXED),
        ("c.dbc", UNMARKED),
        ("a.kcd", KCD),
        ("a.sym", SYM),
        ("a.arxml", ARXML),
    ):
        yield Sound(f"can/{name}", text.encode(), can)
    for name, text in (("msg/A.msg", MSG), ("srv/B.srv", SRV), ("action/C.action", ACTION), ("msg/Pair.idl", IDL)):
        yield Sound(f"mine/{name}", text.encode(), ("sizes", "--definitions", "FILE", "--json", "out.json"))
    yield Sound("model.amxmi", AMALTHEA.encode(), ("import", "FILE", "-o", "out.yaml"))
    write_design(folder)
    for name, text in DESIGN.items():
        data = (DESIGN_FORMAT + text).encode()
        yield Sound(f"design/{name}", data, ("import", "design/system/Robot.system.yaml", "-o", "out.yaml"))
    yield Sound(
        "trace.txt", "".join(trace().splitlines(keepends=True)[:300]).encode(), ("import", "FILE", "-o", "out.yaml")
    )
    yield Sound("caret.yaml", ARCHITECTURE.encode(), ("import", "FILE", "--format", "caret", "-o", "out.yaml"))
    yield Sound("cie.yaml", CONFIGURATION.encode(), ("import", "FILE", "--format", "cie", "-o", "out.yaml"))
    yield Sound("small.aadl", model().encode(), ("import", "FILE", "-o", "out.yaml"))
    yield Sound("chain.aadl", DrawnChain(4).text.encode(), ("analyse", "FILE", "--json", "out.json"))
    yield Sound("arrays.aadl", AADL.encode(), ("analyse", "FILE", "--json", "out.json"))
    yield Sound("start.aadl", AADL.encode(), ("new", "--from", "FILE", "out.yaml", "--force"))
    for path in sorted((ROOT / "problems" / "aadl").glob("*.aadl")):
        (folder / "aadl").mkdir(exist_ok=True)
        (folder / "aadl" / path.name).write_bytes(path.read_bytes())
        yield Sound(f"aadl/of_{path.name}", path.read_bytes(), ("import", "FILE", "-o", "out.yaml"))
    yield from _bags(folder)


def _bags(folder: Path) -> Iterator[Sound]:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    sizes = ("sizes", "--bag", "FILE", "--json", "out.json")
    (folder / "a.bag").unlink(missing_ok=True)
    write_bag(folder / "a.bag")
    yield Sound("bags/a.bag", (folder / "a.bag").read_bytes(), sizes)
    store = get_typestore(Stores.ROS2_HUMBLE)
    text = store.types["std_msgs/msg/String"]
    for plugin in StoragePlugin:
        for mode in CompressionMode:
            if (plugin, mode) == (StoragePlugin.SQLITE3, CompressionMode.STORAGE):
                continue
            home = folder / f"{plugin.name}_{mode.name}".lower()
            shutil.rmtree(home, ignore_errors=True)
            writer = Writer(home, version=8, storage_plugin=plugin)
            if mode != CompressionMode.NONE:
                writer.set_compression(mode, CompressionFormat.ZSTD)
            with writer:
                connection = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
                for stamp_ns in range(30):
                    message = store.serialize_cdr(text("x" * stamp_ns), connection.msgtype)
                    writer.write(connection, 10**18 + stamp_ns, bytes(message))
            for path in sorted(home.iterdir()):
                data = path.read_bytes()
                yield Sound(f"{home.name}/{path.name}", data, ("sizes", "--bag", home.name, "--json", "out.json"))
                if path.suffix in (".db3", ".mcap"):
                    yield Sound(f"bags/{home.name}{path.suffix}", data, sizes)


class ImportFuzzer:
    """Draws cases from a seed and runs them in a folder of its own, as `Fuzzer` does for problems and results."""

    def __init__(self, folder: Path, seed: int) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.seed = folder, seed
        self.files = list(sound_files(folder))
        self.texts = tuple(item.data.decode() for item in self.files if _is_text(item))

    def case(self, number: int) -> Case:
        """The case with this number: always the same one."""
        rng = random.Random(f"{self.seed}/{number}")
        item = rng.choice(self.files)
        data = self._of_text(item.data.decode(), rng) if _is_text(item) else changed_binary(item.data, rng)
        return Case(item.name, data, item.arguments, item.name)

    def _of_text(self, text: str, rng: random.Random) -> bytes:
        others = (*self.texts, " ".join(TOKENS))
        for _ in range(rng.choice((1, 1, 2, 3, 6))):
            if rng.random() < 0.4:
                text = with_token(text, rng)
            else:
                text = rng.choices(_MUTATIONS, (8, 5, 4, 1))[0](text, rng, others)
        data = text.encode(rng.choice(("utf-8", "utf-8", "utf-8", "utf-16", "latin-1")), "replace")
        return changed_bytes(data, rng) if rng.random() < 0.15 else data

    def run(self, case: Case) -> Outcome:
        """Run it, and put the file back that it stands in place of."""
        path = self.folder / case.name
        before = path.read_bytes() if path.exists() else None
        path.parent.mkdir(parents=True, exist_ok=True)
        outcome = run_case(case, self.folder)
        if before is None:
            path.unlink()
        else:
            path.write_bytes(before)
        return outcome


def _is_text(item: Sound) -> bool:
    return not item.name.endswith((".bag", ".db3", ".mcap", ".zstd"))


def with_token(text: str, rng: random.Random) -> str:
    """A word, a number or a place between them becomes something that hurts."""
    at = rng.randrange(len(text) + 1)
    end = at
    if rng.random() < 0.7:
        while at > 0 and text[at - 1 : at].isalnum():
            at -= 1
        while end < len(text) and text[end].isalnum():
            end += 1
    return text[:at] + rng.choice(TOKENS) + text[end:]


def changed_binary(data: bytes, rng: random.Random) -> bytes:
    """Bytes changed or cut out, or a number of four or eight bytes in place of others."""
    if rng.random() < 0.5:
        return changed_bytes(data, rng)
    found = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4))):
        form, mask = rng.choice((("<I", 0xFFFF_FFFF), ("<Q", 2**64 - 1), (">I", 0xFFFF_FFFF), ("<H", 0xFFFF)))
        at = rng.randrange(max(1, len(found) - 8))
        struct.pack_into(form, found, at, rng.choice(_NUMBERS) & mask)
    return bytes(found)
