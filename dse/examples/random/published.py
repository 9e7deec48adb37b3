"""Published figures that random problems are drawn from.

* Automotive: S. Kramer, D. Ziegenbein, A. Hamann, "Real world automotive benchmarks for free", 6th International
  Workshop on Analysis Tools and Methodologies for Embedded and Real-time Systems (WATERS), 2015: the shares of periods
  (Table III), the execution times of runnables (Table IV) and the factors of best and worst case (Table V).
* Robots: the Autoware reference system (github.com/ros-realtime/reference-system, every node 0.22837 ms on an i9, about
  ten times that on an embedded computer), the nodes measured in ECE-TR-25 (73 us to 1.3 ms), and the rates at which
  ROS 2 systems are commonly run (lidars 10 Hz, cameras 20 to 25 Hz, wheel odometry 50 Hz, IMU 100 to 200 Hz,
  controllers 20 to 100 Hz).

Prices and powers are assumptions.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PeriodClass:
    """Runnables of one period: their share in percent, average times in ns, and factors in percent (lowest, highest).

    `least_ns`, `mean_ns` and `most_ns` are over the runnables' averages; `best` and `worst` relate a runnable's
    extremes to its average.
    """

    period_ms: int
    share: int
    least_ns: int
    mean_ns: int
    most_ns: int
    best: tuple[int, int]
    worst: tuple[int, int]


CRANK_PERIOD_MS = 5
"""One segment of a four-cylinder engine at 6000 rpm: 120 s / (6000 * 4)."""

RUNNABLES = (
    PeriodClass(1, 3, 340, 5000, 30110, (19, 92), (130, 2911)),
    PeriodClass(2, 2, 320, 4200, 40690, (12, 89), (154, 1904)),
    PeriodClass(5, 2, 360, 11040, 83380, (17, 94), (113, 1844)),
    PeriodClass(10, 25, 210, 10090, 309870, (5, 99), (106, 3003)),
    PeriodClass(20, 25, 250, 8740, 291420, (11, 98), (106, 1561)),
    PeriodClass(50, 3, 290, 17560, 92980, (32, 95), (113, 776)),
    PeriodClass(100, 20, 210, 10530, 420430, (9, 99), (102, 888)),
    PeriodClass(200, 1, 220, 2560, 21950, (45, 98), (103, 490)),
    PeriodClass(1000, 4, 370, 430, 460, (68, 80), (184, 475)),
)
"""Tables III to V, without the angle-synchronous runnables."""

ANGLE_SYNCHRONOUS = PeriodClass(CRANK_PERIOD_MS, 15, 450, 6520, 88580, (13, 92), (120, 2817))

AUTOMOTIVE_PERIODS_MS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
ROBOT_PERIODS_MS = (1, 2, 4, 5, 10, 20, 25, 40, 50, 100, 200, 250, 500, 1000)
ROBOT_ANCHORS_MS = ((5, 5), (10, 20), (20, 25), (40, 10), (50, 20), (100, 20))
"""Periods of robot software and their weights."""

ROBOT_SENSORS_MS = (5, 10, 20, 40, 50, 100)
AUTOMOTIVE_SENSORS_MS = (1, 5, 10, 20, 50)

ROBOT_WORST_US = (73, 6000)
"""Worst execution times on the reference machine, drawn log-uniformly."""


@dataclass(frozen=True)
class MachineType:
    """A processor type: execution times are `slowness` percent of those of the reference machine."""

    name: str
    slowness: int
    price_eur: int
    power_w: int


ROBOT_MACHINES = (
    MachineType("soc_low", 180, 120, 5),
    MachineType("soc_high", 100, 310, 11),
    MachineType("panel_pc", 65, 640, 28),
    MachineType("i9_pc", 40, 1270, 65),
)
AUTOMOTIVE_MACHINES = (
    MachineType("mcu_160", 190, 17, 1),
    MachineType("mcu_300", 100, 29, 2),
    MachineType("soc_800", 55, 68, 4),
    MachineType("soc_1600", 30, 143, 9),
)
REFERENCE = 1
"""The machine of the starting design, by its place in the catalogue; so for buses."""


@dataclass(frozen=True)
class WireType:
    """A bus type: bandwidth in kbit/s, transmission (fixed, per byte; least and most) in ns, price in EUR."""

    name: str
    kbit_s: int
    fixed_ns: tuple[int, int]
    per_byte_ns: tuple[int, int]
    overhead_bytes: int
    price_eur: int


CAN = (
    WireType("can_125k", 125, (256_000, 376_000), (64_000, 88_000), 0, 4),
    WireType("can_250k", 250, (128_000, 188_000), (32_000, 44_000), 0, 7),
    WireType("can_500k", 500, (64_000, 94_000), (16_000, 22_000), 0, 11),
    WireType("can_1m", 1000, (32_000, 47_000), (8_000, 11_000), 0, 18),
)
FAST_FIELD_BUS = (
    WireType("canfd_2m", 2000, (40_000, 60_000), (4_000, 5_000), 0, 14),
    WireType("canfd_5m", 5000, (36_000, 50_000), (1_600, 2_000), 0, 23),
    WireType("flexray_10m", 10_000, (12_000, 62_000), (800, 1_000), 0, 37),
)
ETHERNET = (
    WireType("ethernet_10m", 10_000, (5_000, 90_000), (800, 800), 66, 21),
    WireType("ethernet_100m", 100_000, (2_000, 40_000), (80, 80), 66, 34),
    WireType("ethernet_1g", 1_000_000, (1_000, 15_000), (8, 8), 66, 73),
    WireType("ethernet_10g", 10_000_000, (1_000, 4_000), (1, 1), 66, 212),
)
WIRE_CLASSES = (CAN, FAST_FIELD_BUS, ETHERNET)

IPC_FIXED_US = (60, 320)
IPC_PER_BYTE_NS = (8, 60)
"""Middleware on the reference machine.

ECE-TR-25 measured 113 us .. 1.1 ms and 7 .. 95 ns per byte on its two computers.
"""

AUTOMOTIVE_SIZES = (1, 2, 2, 4, 8, 8, 8, 16, 32, 64)
ROBOT_SIZES = (8, 16, 30, 64, 100, 152, 256, 366, 1024, 4096)
"""Messages in bytes, each as likely as the others; robots' from ECE-TR-25 and the Autoware reference system."""
