#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares JSON documents and the tables of shared/FORMATS.md with the schemas of shared/schemas.

schema_check.py documents SCHEMA DOCUMENT...   the documents are valid, and damaged ones are not
schema_check.py tables SCHEMAS FORMATS.md      the tables say what the schemas say
schema_check.py write SCHEMAS FORMATS.md       writes the tables
"""
import json
import pathlib
import sys

import jsonschema


def load(path):
    return json.loads(pathlib.Path(path).read_text(encoding="utf-8"))


def follow(schema, root):
    """The schema behind a reference, or behind the choice of a reference or null."""
    for choice in schema.get("anyOf", []):
        schema = choice if "$ref" in choice else schema
    return root["definitions"][schema["$ref"].rsplit("/", 1)[1]] if "$ref" in schema else schema


def objects(schema, root, value):
    """Every object of a document with its schema."""
    schema = follow(schema, root)
    if isinstance(value, dict):
        yield schema, value
        for key, inner in value.items():
            rest = schema.get("additionalProperties") or {}
            yield from objects(schema.get("properties", {}).get(key, rest), root, inner)
    elif isinstance(value, list):
        for inner in value:
            yield from objects(schema.get("items", {}), root, inner)


def check_that_damage_shows(schema, document, validator, seen):
    """Changes one object of each closed schema; `seen` holds the schemas that had their turn."""

    def must_fail(what):
        if validator.is_valid(document):
            sys.exit(f"the schema accepts a document with {what}")

    for part, one in objects(schema, schema, document):
        if part.get("additionalProperties") is not False or id(part) in seen:
            continue
        seen.add(id(part))
        one["undocumented_field"] = 0
        must_fail("an undocumented field")
        del one["undocumented_field"]
        for key in part["required"]:
            value = one.pop(key)
            must_fail(f"no field {key}")
            one[key] = [{}]
            must_fail(f"a field {key} of another type")
            one[key] = value


def closed_schemas(part):
    if isinstance(part, dict):
        if part.get("additionalProperties") is False:
            yield part
        for inner in part.values():
            yield from closed_schemas(inner)


def check_documents(schema_path, paths):
    schema = load(schema_path)
    jsonschema.Draft7Validator.check_schema(schema)
    validator = jsonschema.Draft7Validator(schema)
    seen = set()
    for path in paths:
        document = load(path)
        for error in validator.iter_errors(document):
            place = "/".join(str(step) for step in error.absolute_path)
            sys.exit(f"{path}: {place}: {error.message[:300]}")
        check_that_damage_shows(schema, document, validator, seen)
    count = sum(1 for _ in closed_schemas(schema))
    print(f"{schema['title']}: {len(paths)} documents are valid; {len(seen)} of {count} kinds of object were written")


def type_of(schema):
    if "$ref" in schema:
        return schema["$ref"].rsplit("/", 1)[1]
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if "enum" in schema:
        return ", ".join(f"`{word}`" for word in schema["enum"])
    if "anyOf" in schema:
        return " or ".join(type_of(choice) for choice in schema["anyOf"])
    kind = schema["type"]
    if kind == "array":
        return f"list of {type_of(schema['items'])}"
    if isinstance(schema.get("additionalProperties"), dict):
        return f"map to {type_of(schema['additionalProperties'])}"
    return kind if isinstance(kind, str) else " or ".join(kind)


def row(name, schema):
    text = schema.get("description", "").replace("|", "\\|")
    return f"| {name} | {type_of(schema)} | {schema.get('unit', '')} | {text} |\n"


def rows(schema, prefix=""):
    for key, part in schema.get("properties", {}).items():
        optional = "" if key in schema["required"] else " (optional)"
        yield row(f"`{prefix}{key}`{optional}", part)
        yield from rows(part, f"{prefix}{key}.")
        yield from rows(part.get("items", {}), f"{prefix}{key}[].")


def table(schema):
    lines = "| field | type | unit | meaning |\n|---|---|---|---|\n" + "".join(rows(schema))
    for name, part in schema["definitions"].items():
        lines += row(f"**{name}**", part) + "".join(rows(part))
    return lines


def with_tables(text, schemas):
    for path in sorted(pathlib.Path(schemas).glob("*.schema.json")):
        begin, end = f"<!-- fields of {path.name} -->\n", "<!-- end of fields -->\n"
        before, found, rest = text.partition(begin)
        if not found or end not in rest:
            sys.exit(f"FORMATS.md has no place '{begin.strip()}'")
        text = before + begin + table(load(path)) + rest[rest.index(end):]
    return text


def main():
    match sys.argv[1:]:
        case ["documents", schema, *paths] if paths:
            check_documents(schema, paths)
        case ["tables", schemas, formats]:
            text = pathlib.Path(formats).read_text(encoding="utf-8")
            if with_tables(text, schemas) != text:
                sys.exit("the tables of FORMATS.md differ from the schemas: schema_check.py write SCHEMAS FORMATS.md")
            changed = text.replace(" -->\n| field |", " -->\n| other |", 1)
            if changed == text or with_tables(changed, schemas) == changed:
                sys.exit("a changed table was not seen")
            print("the tables of FORMATS.md are those of the schemas")
        case ["write", schemas, formats]:
            path = pathlib.Path(formats)
            path.write_text(with_tables(path.read_text(encoding="utf-8"), schemas), encoding="utf-8")
        case _:
            sys.exit(__doc__)


main()
