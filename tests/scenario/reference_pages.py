#!/usr/bin/env python3
"""docs/reference/{recipe,rig,cli,errors}.md must match the descriptions in schemas, programs and sources.

    reference_pages.py WEFT WEFTD WEFT_RIG SOURCE_ROOT [--write]      --write: write the pages
"""
import json
import pathlib
import re
import subprocess
import sys

PROGRAMS = {"weft": sys.argv[1], "weftd": sys.argv[2], "weft-rig": sys.argv[3]}
ROOT = pathlib.Path(sys.argv[4]).resolve()
FOLDER = ROOT / "docs/reference"
MADE = "<!-- Made by tests/scenario/reference_pages.py --write from {}; a test compares them. -->"


def number(value):
    return f"{value:g}" if isinstance(value, float) else str(value)


def bounds(schema):
    """The range of a value in a few words."""
    low = f"from {number(schema['minimum'])}" if "minimum" in schema else f"above {number(schema['exclusiveMinimum'])}" if "exclusiveMinimum" in schema else ""
    high = f"to {number(schema['maximum'])}" if "maximum" in schema else ""
    return " ".join(x for x in (low, high) if x)


def kind_of(schema):
    if "enum" in schema:
        return ", ".join(f"`{json.dumps(v)}`" for v in schema["enum"])
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#{name})" if name != "name" else "a name"
    if "oneOf" in schema and "type" not in schema:
        return "one of: " + "; ".join(shape(part) if "properties" in part else kind_of(part) for part in schema["oneOf"])
    kind = schema.get("type", "any")
    if isinstance(kind, list):
        return " or ".join(kind)
    if kind == "array":
        return "list of " + kind_of(schema.get("items") or {"type": "values"})
    if kind == "object" and isinstance(schema.get("additionalProperties"), dict):
        return "by name: " + kind_of(schema["additionalProperties"])
    unit = schema.get("x-unit", "")
    return kind + (f" [{unit}]" if unit and unit != "1" else "")


def shape(schema):
    return "{" + ", ".join(f"{k}: {kind_of(v)}" for k, v in schema.get("properties", {}).items()) + "}"


def alternatives(schema):
    """A table for an object that is one of several, each with a name and its own list."""
    yield "| name | each of its values | bounds | |\n|---|---|---|---|"
    for each in schema["oneOf"]:
        name, values = each["properties"]["name"], each["properties"]["values"]
        yield f"| {kind_of(name)} | {kind_of(values['items'])} | {bounds(values['items'])} | {values.get('description', '')} |"
    yield ""


def needed_alternatives(schema):
    """{key: default column} of groups of keys of which one is needed: in the row of the first key."""
    groups = [part["oneOf"] for part in schema.get("allOf", []) if "oneOf" in part] + ([schema["oneOf"]] if "oneOf" in schema else [])
    out = {}
    for group in groups:
        keys = [part["required"][0] for part in group if len(part.get("required", [])) == 1]
        if len(keys) == len(group):
            out[keys[0]] = "needed (or " + " or ".join(f"`{key}`" for key in keys[1:]) + ")"
    return out


def rows(schema, definitions=None):
    """A table of the keys of an object."""
    if "oneOf" in schema and "properties" not in schema:
        yield from alternatives(schema)
        return
    needed = schema.get("required", [])
    either = needed_alternatives(schema)
    yield "| key | value | bounds | default | |\n|---|---|---|---|---|"
    for key, value in schema["properties"].items():
        default = f"`{json.dumps(value['default'])}`" if "default" in value else "needed" if key in needed else either.get(key, "")
        named = (definitions or {}).get(value.get("$ref", "").rpartition("/")[2], {})
        words = value.get("description", named.get("description", "")).replace("|", "\\|")
        if "prefixItems" in json.dumps(value):
            words += " " + " or ".join(", ".join(kind_of(item) for item in each["prefixItems"]) for each in value["oneOf"])
        yield f"| `{key}` | {kind_of(value) if 'prefixItems' not in json.dumps(value) else 'list'} | {bounds(value)} | {default} | {words} |"
    yield ""


def objects(schema):
    """Objects defined in place, without a name among the definitions."""
    for key, value in schema.get("properties", {}).items():
        if "object" in value.get("type", "") and "properties" in value:
            yield key, value


def without_references(schema):
    """Removes the alternative "reference to a parameter", which exists nearly everywhere: the page states it once."""
    if isinstance(schema, list):
        return [without_references(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    if schema.get("anyOf", [None])[-1] == {"$ref": "#/$defs/reference"}:
        schema = {**schema["anyOf"][0], **{k: v for k, v in schema.items() if k != "anyOf"}}
    return {k: without_references(v) for k, v in schema.items()}


def recipe_page():
    schema = without_references(json.loads((ROOT / "recipes/schema/recipe.schema.json").read_text()))
    out = [MADE.format("recipes/schema/recipe.schema.json"), "# Recipes, key by key", "",
           "For everybody who writes a recipe: every key of the file, with unit, bounds and default. Editors and `recipe.schema` of the API have the same schema.", "",
           schema["description"], "", "How to write a recipe: [own recipe](../howto/own-recipe.md). Phases, force and guards: [force control](../explanation/force-control.md). "
           "If a length, speed or force has keys in two units, state one of them. "
           "A number, a text or a choice may be a [reference](#reference) to a [parameter](#parameter).", "",
           "## The recipe", ""]
    definitions = schema["$defs"]
    out += rows(schema, definitions)
    sections = list(objects(schema)) + [(k, v) for k, v in definitions.items() if k != "name"]
    for name, value in sections:
        out += [f"## {name}", "", (f"**{value['title']}.** " if "title" in value else "") + value.get("description", ""), ""]
        out += rows(value, definitions)
        for inner, inner_value in objects(value):
            out += [f"### {inner}", "", inner_value.get("description", ""), ""]
            out += rows(inner_value)
    return "\n".join(out).rstrip() + "\n"


def stage_table():
    """The rows of protocols/apt/stage_table.cpp, by stage and scale."""
    text = (ROOT / "protocols/apt/stage_table.cpp").read_text()
    stages = [(name, axis, numbers.split(", "), usual, source) for name, axis, numbers, usual, source in
              re.findall(r'StageModel\{"([^"]+)", (\w+), ([-\d., ]+), "([^"]+)", "([^"]+)"\}', text)]
    pairings = re.findall(r'Pairing\{"([^"]+)", "[^"]+", "([^"]+)", \{([^}]+)\}, "([^"]+)"\}', text)
    if not stages or len(stages) != text.count("StageModel{") or len(pairings) != text.count("Pairing{"):
        raise SystemExit("rig.md: protocols/apt/stage_table.cpp has a row of another form")
    out = ["### Stages and controllers", "", "From `protocols/apt/stage_table.cpp`, which driver, emulator and `weft check` follow. Units: mm or degrees, and seconds. Controllers of one line count alike; the "
           "first line of a stage is taken unless `controller` names one of another. A controller that is not listed for a stage is refused. \"memory\": no source was found; check such a "
           "limit against the stage's data sheet. Other sources: [device facts](device-facts.md).", "",
           "| stage | unit | controllers | counts per unit | per unit/s | per unit/s2 | source of the scale | travel | top speed, acceleration | default speed, acceleration | homing speed, offset | source of the limits |",
           "|---|---|---|--:|--:|--:|---|---|---|---|---|---|"]
    for name, axis, numbers, _, source in stages:
        scales = {}
        for stage, controller, scale, scale_source in pairings:
            if stage == name:
                scales.setdefault((scale, scale_source), []).append(controller)
        low, high, speed, acceleration, usual_speed, usual_acceleration, home, offset = numbers[:8]
        for (scale, scale_source), controllers in scales.items():
            counts = " | ".join(f"{float(value):.8g}" for value in scale.split(", "))
            out.append(f"| {name} | {'mm' if axis == 'linear' else 'deg'} | {', '.join(controllers)} | {counts} | {scale_source} | {low} to {high} | {speed}, {acceleration} "
                       f"| {usual_speed}, {usual_acceleration} | {home}, {offset} | {source} |")
    return out + [""]


def rig_page():
    out = [MADE.format("config_schema in drivers/*/*.cpp"), "# Rig files: keys of the drivers", "",
           "For everybody who writes a rig file: the keys of `devices[].config`, by driver. All other keys: [rig files](rig-keys.md). "
           "Complete files: [shipped rig files](rig-keys.md#shipped-rig-files).", ""]
    schemas = {file: re.findall(r'config_schema\[\] = R"\((.*?)\)";', file.read_text(), re.S) for file in (ROOT / "drivers").glob("*/*.cpp")}
    for file, (text,) in sorted((file, found) for file, found in schemas.items() if found):
        schema = json.loads(text)
        out += [f"## {file.parent.name}", "", f"{schema['title']}: [drivers/{file.parent.name}](../../drivers/{file.parent.name}/README.md).", ""]
        out += rows(schema)
        if file.parent.name == "thorlabs_apt":
            out += stage_table()
    return "\n".join(out).rstrip() + "\n"


def help_of(*words):
    text = subprocess.run([*words, *([] if words[-1] == "--help-all" else ["--help"])], capture_output=True, text=True, check=True).stdout.strip("\n")
    return help_of(*words, "--help-all") if "--help-all" in text and words[-1] != "--help-all" else text


def commands_in(text):
    found = text.partition("Subcommands:\n")[2].partition("\n\n")[0]
    return re.findall(r"^  (\S+) ", found, re.M)


def groups_in(text):
    """[(heading, commands)] of the help of weft."""
    groups = [(heading, re.findall(r"^  (?!e\.g\.)(\S+) ", rows, re.M)) for heading, rows in re.findall(r"^([A-Z]\w+: [^\n]+)\n((?:  [^\n]+\n)+)", text, re.M)]
    also, = re.findall(r"^Also: (.*), --json", text, re.M)
    earlier, = re.findall(r"^Old names[^:]*: (.*)$", text, re.M)
    return [*groups, ("Also", also.split(", ")), ("Old names", earlier.split(", "))]


def notes_of():
    """Notes by command: what does not fit into the help of an option, from cli.notes.md."""
    text = (FOLDER / "cli.notes.md").read_text()
    return {command: notes.strip() for command, notes in re.findall(r"^## (\S[^\n]*)\n(.*?)(?=^## |\Z)", text, re.M | re.S)}


def cli_page():
    notes = notes_of()
    out = [MADE.format("--help of each program and docs/reference/cli.notes.md"), "# Commands", "",
           "For everybody who types commands: every command and option. `man weft` has the same without the notes where Weft is installed.", ""]

    def add(words, depth, text=None):
        text = text or help_of(PROGRAMS[words[0]], *words[1:])
        out.extend([f"{'#' * depth} {' '.join(words)}", "", "```text", text, "```", ""])
        if more := notes.pop(" ".join(words), None):
            out.extend([more, ""])
        return [[*words, name] for name in commands_in(text)]

    def add_all(words, depth):
        for command in add(words, depth):
            add_all(command, min(depth + 1, 4))

    for program in PROGRAMS:
        text = help_of(PROGRAMS[program])
        if program != "weft":
            add([program], 2, text)
            continue
        add([program], 2, text)
        for heading, commands in groups_in(text):
            out.extend([f"## {heading}", ""])
            for command in commands:
                add_all([program, command], 3)
    if notes:
        raise SystemExit(f"cli.notes.md: no command {', '.join(notes)}")
    return "\n".join(out).rstrip() + "\n"


def kinds_in_source():
    """{kind: numbers} of the errors that daemon/service makes, over JSON-RPC and over HTTP."""
    blocks = dict(re.findall(r"inline constexpr int (\w+) = (-?\d+);", (ROOT / "daemon/service/rpc/message.hpp").read_text()))
    methods, http = {}, {}
    for file in sorted((ROOT / "daemon/service").glob("**/*.?pp")):
        text = file.read_text()
        for block, more, kind in re.findall(r'\w+\(\s*(?:[\w:.()]+,\s*)?(?:std::move\(id_json\),\s*|"null",\s*)?(?:rpc::)?code::(\w+)(?:\s*\+\s*(\d+))?,\s*"([a-z_.]+)"', text):
            methods.setdefault(kind, set()).add(int(blocks[block]) + int(more or 0))
        for kind in re.findall(r'\bwrong\("([a-z_.]+)"', text):  # in find_problem()
            methods.setdefault(kind, set()).add(int(blocks["invalid_params"]))
        for statuses, kind in re.findall(r'\brefused\(\s*((?:\w+ \? \d+ : )?\d+),\s*"([a-z_.]+)"', text):
            http.setdefault(kind, set()).update(int(status) for status in re.findall(r"\b\d+\b", statuses))
    return methods, http


def kinds_tables():
    """The tables of errors.kinds.md, which must have the kinds and numbers of the source."""
    parts = re.findall(r"^## \w+\n\n(.*?)(?=\n## |\Z)", (FOLDER / "errors.kinds.md").read_text(), re.M | re.S)
    for table, found in zip(parts, kinds_in_source(), strict=True):
        listed = {kind: {int(n) for n in numbers.split(", ")} for kind, numbers in re.findall(r"^\| `([^`]+)` \| ([-\d, ]+) \|", table, re.M)}
        if listed != found:
            different = sorted(kind for kind in listed | found if listed.get(kind) != found.get(kind))
            raise SystemExit("errors.kinds.md differs from daemon/service: " +
                             "; ".join(f"{kind}: {sorted(listed.get(kind, []))} (expected {sorted(found.get(kind, []))})" for kind in different))
    return [table.strip() for table in parts]


def errors_page():
    """The table of protocols/base/result.cpp and those of errors.kinds.md."""
    row = r'\{Errc::\w+, "([^"]+)", "([^"]+)", (\d+), (true|false), "([^"]+)", "([^"]+)"\}'
    text = re.sub(r"\s*\n\s*", " ", (ROOT / "protocols/base/result.cpp").read_text())
    rows = re.findall(row, text)
    methods, http = kinds_tables()
    out = [MADE.format("protocols/base/result.cpp and docs/reference/errors.kinds.md"), "# Error codes", "",
           "For authors of scripts and clients, and for people who read a message: exit statuses, error codes and kinds.", "",
           "The command line prints an error as one sentence: \"where: what: got (expected X). Hint.\" An empty part is left out.", "",
           "## Exit statuses", "", "| status of `weft` | meaning |", "|---|---|", "| 0 | Success. |", "| 1 | Refused or failed; the sentence is on standard error. |",
           "| 2 | Invalid command line. |", "| 3 | `weft run`: complete, but not within the requested accuracy. `weft sim calibrate`: the table is written, but the simulation "
           "does not resemble the recordings. |", "| 128 + n | Ended by signal n, after clean-up. |", "",
           "With `--json` a failure is one object on standard output: `{\"error\": {code, number, message, where, expected, got, hint, sentence}}`. `code` is the first column of the "
           "next table; `number` is that of exported files, not that of the API. A refused recipe or rig adds `problems`, a list with `file`, `pointer`, `message`, `expected`, "
           "`got`, `hint` and `sentence`. An invalid command line has `code` \"usage\", `message` and `sentence` only.", "",
           "## Codes", "", "Over the API `error.code` is the number of the row and `error.data.kind` the kind. `error.data.retryable`: the same request may succeed later.", "",
           "| code | kind | number | retryable | meaning | what to do |", "|---|---|---|---|---|---|"]
    out += [f"| {name} | `{kind}` | {number} | {'yes' if again == 'true' else 'no'} | {meaning} | {advice} |"
            for name, kind, number, again, meaning, advice in rows]
    if len(rows) != text.count("{Errc::"):
        raise SystemExit(f"errors.md: {len(rows)} rows read (expected {text.count('{Errc::')}): protocols/base/result.cpp has a row of another form")
    out += ["", "## Kinds of the methods", "", "The [API](api.md) has these as well. A client tests the kind; a number may have several kinds.", "", methods, "",
            "## Kinds over HTTP only", "", "`error.code` is 2000; the status of the answer differs.", "", http]
    return "\n".join(out) + "\n"


def main():
    pages = {"errors.md": errors_page(), "recipe.md": recipe_page(), "rig.md": rig_page(), "cli.md": cli_page()}
    stale = [name for name, text in pages.items() if not (FOLDER / name).exists() or (FOLDER / name).read_text() != text]
    if "--write" in sys.argv:
        for name in stale:
            (FOLDER / name).write_text(pages[name])
    elif stale:
        print(f"docs/reference: {', '.join(stale)} no longer agrees with schemas and programs. This makes them anew:\n"
              f"    python3 tests/scenario/reference_pages.py {' '.join(PROGRAMS.values())} {ROOT} --write")
        return 1
    print(f"{len(pages)} pages")
    return 0


sys.exit(main())
