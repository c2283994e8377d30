"""The schemas in docs/json: which documents of kmax they hold for, and what they say of one."""

import json
from pathlib import Path

import jsonschema

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "json"
_SCHEMAS = {path.as_uri(): json.loads(path.read_text()) for path in FOLDER.glob("*.schema.json")}
Validator = jsonschema.Draft202012Validator


def schema_file(name):
    return FOLDER / f"{name}.schema.json"


def problems(document, name, part=""):
    """What is wrong with a document by NAME.schema.json, or by a part of it, "#/$defs/PART"; empty: nothing."""
    place = schema_file(name).as_uri()
    schema = {"$ref": place + part}
    resolver = jsonschema.RefResolver(FOLDER.as_uri() + "/", schema, store=_SCHEMAS)
    return [f"{'/'.join(map(str, error.absolute_path)) or 'the whole'}: {error.message[:500]}"
            for error in Validator(schema, resolver=resolver).iter_errors(document)]


def check(test, document, name, part=""):
    test.assertEqual(problems(document, name, part), [], f"{name}{part}: {json.dumps(document)[:2000]}")
