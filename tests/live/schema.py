# SPDX-License-Identifier: Apache-2.0
"""As much of JSON Schema as our descriptions use."""
import re

TYPES = {"boolean": bool, "object": dict, "array": list, "string": str, "integer": int,
         "number": (int, float)}


def fits(value, schema, where="line"):
    """What is wrong with a value by those words of JSON Schema that ours uses; None for nothing."""
    known = {"$schema", "title", "description", "type", "required", "properties", "items", "const",
             "enum", "minimum", "pattern", "minItems", "maxItems"}
    assert set(schema) <= known, set(schema) - known
    strange_bool = isinstance(value, bool) and schema["type"] != "boolean"
    if not isinstance(value, TYPES[schema["type"]]) or strange_bool:
        return f"{where} is {value!r}, not of type {schema['type']}"
    if "const" in schema and value != schema["const"] or value not in schema.get("enum", [value]):
        return f"{where} is {value!r}"
    if value < schema["minimum"] if "minimum" in schema else False:
        return f"{where} is {value!r}"
    if "pattern" in schema and not re.search(schema["pattern"], value):
        return f"{where} is {value!r}"
    if isinstance(value, dict) and "properties" in schema:
        missing = set(schema.get("required", [])) - set(value)
        strange = set(value) - set(schema["properties"])
        if missing or strange:
            return f"{where} lacks {missing}, has {strange}"
        for key, part in value.items():
            wrong = fits(part, schema["properties"][key], f"{where}.{key}")
            if wrong:
                return wrong
    if isinstance(value, list):
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            return f"{where} has {len(value)} entries"
        for part in value:
            wrong = fits(part, schema["items"], where + "[]")
            if wrong:
                return wrong
    return None
