"""How messages are framed on the wire, as a bus type states it: a class for each protocol."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag, WithJsonSchema

from dse.spec.schema.fields import describe, field_error
from dse.spec.schema.parts import ReadBy, StrictMapping
from dse.spec.schema.quantity_fields import Bandwidth, DataSize


class FrameModel(StrictMapping):
    """Base of the frames."""


class CanFrame(FrameModel):
    """CAN 2.0 with worst-case bit stuffing; identifiers of 11 or 29 bits."""

    protocol: Literal["can"]
    identifier_bits: Literal[11, 29] = 11


class CanFdFrame(FrameModel):
    """CAN FD: data go at `data_bandwidth`, the rest at the bandwidth of the bus."""

    protocol: Literal["can_fd"]
    identifier_bits: Literal[11, 29] = 11
    data_bandwidth: Bandwidth


def _stop_bits(value: Any) -> int:
    if isinstance(value, bool) or value not in (1, 1.5, 2):
        raise field_error(f"expected 1, 1.5 or 2, got {describe(value)}")
    return int(2 * value)


StopBits: TypeAlias = Annotated[int, ReadBy(_stop_bits), WithJsonSchema({"enum": [1, 1.5, 2]})]
"""Counted in halves."""


class SerialFrame(FrameModel):
    """RS-232, RS-485 and their like: each byte with a start bit, parity and stop bits."""

    protocol: Literal["serial"]
    data_bits: Literal[5, 6, 7, 8, 9] = 8
    parity: Literal["none", "even", "odd", "mark", "space"] = "none"
    stop_bits: StopBits = 2


class EthernetFrame(FrameModel):
    """Ethernet with preamble, gap and least frame; IP with UDP or TCP on top where it is stated."""

    protocol: Literal["ethernet"]
    transport: Literal["none", "udp", "tcp", "tcp_timestamps"] = "none"
    network: Literal["ipv4", "ipv6"] = "ipv4"
    vlan: bool = False
    mtu: DataSize = 1500


class EthercatFrame(FrameModel):
    """EtherCAT: each message is a datagram in a frame of its own."""

    protocol: Literal["ethercat"]


class FlexrayFrame(FrameModel):
    """The static segment of FlexRay; all of its slots have the same `payload` where it is stated."""

    protocol: Literal["flexray"]
    payload: DataSize | None = None
    transmission_start_bits: Annotated[int, Field(ge=1, le=15)] = 15


PROTOCOLS = ("can", "can_fd", "serial", "ethernet", "ethercat", "flexray")
MODELS: dict[str, type[FrameModel]] = {
    " can ": CanFrame,
    " can_fd ": CanFdFrame,
    " serial ": SerialFrame,
    " ethernet ": EthernetFrame,
    " ethercat ": EthercatFrame,
    " flexray ": FlexrayFrame,
}
"""By the tag of the union, whose blanks keep it apart from names in the file."""
IN_A_WORD = " in a word "
WORDS = ("can", "serial", "ethernet", "ethercat", "flexray")
"""Protocols whose frames need no further figure."""


def _which(value: Any) -> str:
    protocol = value.get("protocol") if isinstance(value, dict) else None
    tag = f" {protocol} "
    return tag if isinstance(protocol, str) and tag in MODELS else IN_A_WORD


def _word(value: Any) -> FrameModel:
    """``can`` means ``{protocol: can}``; everything else here is wrong."""
    if isinstance(value, dict):
        if "protocol" in value:
            raise field_error(
                f"expected one of {', '.join(PROTOCOLS)} as `protocol`, got {describe(value['protocol'])}"
            )
        raise field_error("missing key `protocol`", f"one of {', '.join(PROTOCOLS)}")
    if value == "can_fd":
        raise field_error("can_fd needs a `data_bandwidth`", "{protocol: can_fd, data_bandwidth: 2 Mbit/s}")
    if not isinstance(value, str) or value not in WORDS:
        hint = f"such as {', '.join(WORDS)}, or a mapping with `protocol`"
        raise field_error(f"expected how messages are framed, got {describe(value)}", hint)
    return MODELS[f" {value} "].model_validate({"protocol": value})


FrameWord: TypeAlias = Annotated[FrameModel, ReadBy(_word), WithJsonSchema({"enum": list(WORDS)})]
FrameType: TypeAlias = Annotated[
    Annotated[CanFrame, Tag(" can ")]
    | Annotated[CanFdFrame, Tag(" can_fd ")]
    | Annotated[SerialFrame, Tag(" serial ")]
    | Annotated[EthernetFrame, Tag(" ethernet ")]
    | Annotated[EthercatFrame, Tag(" ethercat ")]
    | Annotated[FlexrayFrame, Tag(" flexray ")]
    | Annotated[FrameWord, Tag(IN_A_WORD)],
    Discriminator(_which),
]
