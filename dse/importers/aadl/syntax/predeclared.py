"""Declarations that every AADL model has: predeclared property sets, their units, and Base_Types.

Only what the analyses read is here: which set a property is in, whether a component inherits it, and its unit's worth.
"""

from __future__ import annotations

from fractions import Fraction

INHERITED = frozenset(
    (
        "period", "deadline", "priority", "actual_processor_binding", "actual_connection_binding",
        "allowed_processor_binding", "allowed_connection_binding", "reference_processor", "reference_time",
        "required_virtual_bus_class", "scheduling_protocol", "actual_memory_binding", "execution_time",
    )
)  # fmt: skip
"""Properties that a component has from the one around it where it states none itself."""

_SETS = {
    "communication_properties": (
        "latency", "transmission_time", "timing", "queue_size", "output_rate", "input_rate", "connection_pattern",
        "overflow_handling_protocol", "queue_processing_protocol", "fan_out_policy", "required_connection",
        "transmission_type", "data_rate", "connection_set", "actual_latency", "input_time", "output_time",
    ),
    "timing_properties": (
        "period", "deadline", "compute_execution_time", "compute_deadline", "execution_time", "reference_time",
        "reference_processor", "processor_capacity", "clock_period", "frame_period", "slot_time", "first_dispatch_time",
        "dispatch_jitter", "dispatch_offset", "startup_deadline", "clock_jitter", "time_slot", "synchronized_component",
        "recover_execution_time", "initialize_execution_time", "activate_execution_time", "deactivate_execution_time",
        "finalize_execution_time", "thread_swap_execution_time", "process_swap_execution_time", "scheduler_quantum",
        "clock_period_range", "recover_deadline", "initialize_deadline", "finalize_deadline",
    ),
    "thread_properties": (
        "dispatch_protocol", "dispatch_trigger", "priority", "posix_scheduling_policy", "urgency",
        "concurrency_control_protocol", "thread_limit", "dequeue_protocol",
    ),
    "deployment_properties": (
        "actual_processor_binding", "actual_connection_binding", "actual_memory_binding", "allowed_processor_binding",
        "allowed_connection_binding", "allowed_processor_binding_class", "allowed_connection_binding_class",
        "required_virtual_bus_class", "provided_virtual_bus_class", "scheduling_protocol", "not_collocated",
        "collocated", "actual_function_binding", "runtime_protection", "allowed_memory_binding",
    ),
    "memory_properties": (
        "data_size", "source_data_size", "memory_size", "code_size", "stack_size", "source_code_size", "heap_size",
        "source_stack_size", "source_heap_size", "byte_count", "word_size", "access_right", "memory_protocol",
    ),
    "sei": (
        "bandwidthcapacity", "bandwidthbudget", "mipscapacity", "mipsbudget", "response_time", "data_rate",
        "romactual", "ramactual",
        "message_rate", "broadcast_protocol", "instructionsperdispatch", "partition_latency", "is_partition",
        "reference_cycle_time", "ramcapacity", "rambudget", "romcapacity", "rombudget", "powercapacity", "powerbudget",
        "powersupply", "price", "netweight", "grossweight", "weightlimit", "safetycriticality", "securitylevel",
        "nsloc", "stream_miss_rate", "required_virtual_bus", "max_message_size",
    ),
    "arinc653": (
        "module_major_frame", "module_schedule", "partition_slots", "slots_allocation", "partition_name",
        "window_start", "partition_identifier", "module_version", "module_identifier", "dal", "timing_requirements",
    ),
}  # fmt: skip
SET_OF = {name: group for group, names in _SETS.items() for name in names if group not in ("sei", "arinc653")}
"""The set of each property that needs no prefix."""
STANDARD = frozenset(name for names in _SETS.values() for name in names)
"""The properties of these sets: what is told of each by itself where nothing looks at it."""
PREDECLARED = frozenset(
    (*_SETS, "aadl_project", "aadl_properties", "base_types", "data_model", "programming_properties",
     "modeling_properties", "code_generation_properties", "arinc429", "emv2", "error_library", "physical", "hostility",
     "behavior_properties", "behavior", "data_sheet", "physicaltypes", "security_enforcement_properties",
     "security_classification_properties", "security_type_specifications", "security_trust", "agree_properties", "dse")
)  # fmt: skip
"""Packages and property sets that a model may name without a file that declares them."""

TIME_UNITS = {
    "ps": Fraction(1, 1000), "ns": Fraction(1), "us": Fraction(10**3), "ms": Fraction(10**6), "sec": Fraction(10**9),
    "min": Fraction(60 * 10**9), "hr": Fraction(3600 * 10**9),
}  # fmt: skip
"""Nanoseconds."""
SIZE_UNITS = {
    "bits": Fraction(1, 8), "bytes": Fraction(1), "kbyte": Fraction(10**3), "mbyte": Fraction(10**6),
    "gbyte": Fraction(10**9), "tbyte": Fraction(10**12), "b": Fraction(1), "kb": Fraction(10**3), "mb": Fraction(10**6),
    "gb": Fraction(10**9),
}  # fmt: skip
"""Bytes; 1 KByte is 1000 of them."""
DATA_RATE_UNITS = {
    "bitsps": Fraction(1), "kbitsps": Fraction(10**3), "mbitsps": Fraction(10**6), "gbitsps": Fraction(10**9),
    "bytesps": Fraction(8), "kbytesps": Fraction(8 * 10**3), "mbytesps": Fraction(8 * 10**6),
    "gbytesps": Fraction(8 * 10**9),
}  # fmt: skip
"""bit/s."""
SPEED_UNITS = {"kips": Fraction(1, 1000), "mips": Fraction(1), "gips": Fraction(1000), "ipd": Fraction(1),
               "kipd": Fraction(1000), "mipd": Fraction(10**6)}  # fmt: skip
"""MIPS (and instructions for each dispatch)."""
MESSAGE_RATE_UNITS = {"persec": Fraction(1), "perms": Fraction(1000), "permin": Fraction(1, 60), "hz": Fraction(1),
                      "persecond": Fraction(1)}  # fmt: skip
"""Hz."""
POWER_UNITS = {"w": Fraction(1000), "mw": Fraction(1), "kw": Fraction(10**6)}
"""mW."""

_SIZES = {
    "Integer_8": 1, "Integer_16": 2, "Integer_32": 4, "Integer_64": 8, "Unsigned_8": 1, "Unsigned_16": 2,
    "Unsigned_32": 4, "Unsigned_64": 8, "Float_32": 4, "Float_64": 8,
}  # fmt: skip
BASE_TYPES = "package Base_Types public\n" + "\n".join(
    [
        *(f"data {name} end {name};" for name in ("Boolean", "Integer", "Natural", "Float", "Character", "String")),
        *(f"data {name} properties Data_Size => {size} Bytes; end {name};" for name, size in _SIZES.items()),
        "end Base_Types;",
    ]
)
"""The predeclared package of data types, with the sizes of those that have one."""
