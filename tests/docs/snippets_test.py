#!/usr/bin/env python3
"""Every block of code in the pages is what it says.

C++ and C are compiled (syntax and types alone): whole programs as they are, fragments as the body of a function
among what context.h declares. A fragment that stands in a file of plugin/examples word for word is compiled and
run there. Python is compiled, JSON parsed, and what is part of a scene or a batch file is read by the command.

    python3 tests/docs/snippets_test.py --carom CAROM --cxx g++ --cc gcc -- -I...
"""

import argparse
import ast
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from pages import ROOT, pages, split

FUNCTION = re.compile(r"^(?!\s|for\b|if\b|while\b|else\b|switch\b|return\b)[\w:<>&*,\s]+\([^;{}]*\)\s*(const\s*)?\{\s*(//.*)?$", re.M)
SCENE_PARTS = ("mechanics", "restitutions", "room", "listeners", "camera")


def examples():
    files = sorted((ROOT / "plugin" / "examples").rglob("*.[ch]*"))
    return ["\n" + file.read_text(encoding="utf-8") for file in files]


def is_quoted(block, texts):
    """True if the lines of the block follow each other in one of the examples."""
    return any("\n" + block.text in text for text in texts)


def position(block):
    return f'#line {block.line} "{block.page}"\n'


def cpp_source(blocks):
    """Returns one source that holds all fragments, each in a function of the namespace of its page."""
    named = set(re.findall(r"^namespace page_(\w+) \{", (ROOT / "tests/docs/context.h").read_text(encoding="utf-8"), re.M))
    includes, bodies = [], []
    for number, block in enumerate(blocks):
        lines = block.text.splitlines()
        includes += [line for line in lines if line.startswith("#include")]
        text = "\n".join("" if line.startswith("#include") else line for line in lines)
        page = block.page.stem if block.page.stem in named else "any"
        if FUNCTION.search(text):
            body = f"{position(block)}{text}\n"
        else:
            body = f"Returned fragment_{number}() {{\n{position(block)}{text}\n  return {{}};\n}}\n"
        bodies.append(f"namespace page_{page} {{\nnamespace block_{number} {{\n{body}}}\n}}\n")
    head = "\n".join(dict.fromkeys(includes))
    return f'#include "tests/docs/context.h"\n{head}\nnamespace docs_snippets {{\n{"".join(bodies)}}}\n'


def c_source(blocks):
    bodies = [f"int fragment_{number}(void) {{\n{position(block)}{block.text}  return 0;\n}}\n"
              for number, block in enumerate(blocks)]
    return '#include "tests/docs/context_c.h"\n' + "".join(bodies)


def compiles(command, source, name, folder):
    file = folder / name
    file.write_text(source, encoding="utf-8")
    run = subprocess.run([*command, "-fsyntax-only", str(file)], capture_output=True, text=True, timeout=600)
    return "" if run.returncode == 0 else run.stderr


def check_compiled(options, blocks, folder):
    """Returns what the compilers say of all C++ and C."""
    texts = examples()
    fragments = {language: [block for block in blocks if block.language == language and not is_quoted(block, texts)
                            and "int main(" not in block.text] for language in ("cpp", "c")}
    wrong = [f"{block.place()}: is a program, and none of plugin/examples" for block in blocks
             if block.language in ("cpp", "c") and "int main(" in block.text and not is_quoted(block, texts)]
    flags = [f"-I{ROOT}", "-Wall", "-Werror", "-Wno-unused", *options.flags]
    wrong.append(compiles([options.cxx, "-std=c++20", "-Wno-unused-result", *flags],
                          cpp_source(fragments["cpp"]), "fragments.cpp", folder))
    wrong.append(compiles([options.cc, "-std=c99", *flags], c_source(fragments["c"]), "fragments.c", folder))
    print(f"{len(fragments['cpp'])} fragments of C++ and {len(fragments['c'])} of C are compiled")
    return wrong


def check_python(blocks):
    wrong = []
    for block in blocks:
        if block.language == "python":
            try:
                ast.parse(block.text)
            except SyntaxError as error:
                wrong.append(f"{block.place()}: {error}")
    return wrong


def parsed(block):
    """Returns the value of a block of JSON; of a part of an object, the object that it makes."""
    text = block.text.strip()
    return json.loads("{" + text + "}" if text.startswith('"') else text)


def scene_around(value):
    """Returns a scene in which the value is what it is in the page, or None if it is no part of a scene."""
    ball = {"type": "sphere", "radius": 0.01, "material": "steel"}
    scene = {"duration": 0.01, "listeners": [{"position": [0, 1.5, 3]}], "bodies": [
        {**ball, "name": "ball1", "position": [2, 0.5, 0]}, {**ball, "name": "ball2", "position": [2.1, 0.5, 0]}]}
    if isinstance(value, list):
        return {**scene, "camera": value}
    if "bodies" in value and "listeners" in value:
        return value
    if "type" in value:
        scene["bodies"].append(value)
        return {**scene, "stepper": {"type": "bullet"}} if value["type"] == "solid" else scene
    if value and all(key in SCENE_PARTS for key in value):
        if "room" in value:
            scene["bodies"].append({"type": "box", "name": "room", "min": [-4, 0, -4], "max": [4, 3, 4], "material": "wood"})
        return {**scene, **value}
    return None


def check_scene(options, block, scene, folder):
    file = folder / "scene.json"
    file.write_text(json.dumps({key: value for key, value in scene.items() if key != "$schema"}), encoding="utf-8")
    run = subprocess.run([options.carom, "info", str(file)], capture_output=True, text=True, timeout=300)
    return "" if run.returncode == 0 else f"{block.place()}: {run.stderr.strip()}"


def check_batch(options, block, folder):
    (folder / "batches").mkdir(exist_ok=True)
    library = folder / "library"
    if not library.exists():
        library.symlink_to(ROOT / "scenes" / "library")
    (folder / "batches" / "batch.json").write_text(block.text, encoding="utf-8")
    run = subprocess.run([options.carom, "batch", "plan", str(folder / "batches/batch.json"), "--count", "3", "-o",
                          str(folder / "plan")], capture_output=True, text=True, timeout=300)
    return "" if run.returncode == 0 else f"{block.place()}: {run.stderr.strip()}"


def check_json(options, blocks, folder):
    shutil.copy(ROOT / "scenes/library/meshes/wrench.obj", folder / "wrench.obj")
    wrong, read = [], 0
    for block in blocks:
        if block.language != "json":
            continue
        try:
            value = parsed(block)
        except json.JSONDecodeError as error:
            wrong.append(f"{block.place()}: {error}")
            continue
        scene = scene_around(value)
        read += scene is not None or "parameters" in value
        if scene is not None:
            wrong.append(check_scene(options, block, scene, folder))
        elif "parameters" in value:
            wrong.append(check_batch(options, block, folder))
    print(f"{read} blocks of JSON are read by the command")
    return wrong


def check_steps(blocks):
    """Returns which blocks of C++ of the tutorial are none of its programs."""
    texts = examples()
    return [f"{block.place()}: stands in no file of plugin/examples" for block in blocks
            if block.page.name == "getting_started.md" and block.language == "cpp" and not is_quoted(block, texts)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--carom", required=True, help="the command")
    parser.add_argument("--cxx", default="c++", help="the compiler of C++")
    parser.add_argument("--cc", default="cc", help="the compiler of C")
    parser.add_argument("flags", nargs="*", help="of both, where headers are")
    options = parser.parse_args()
    blocks = [block for page in pages() for block in split(page)[0]]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        wrong = check_steps(blocks) + check_python(blocks) + check_json(options, blocks, folder)
        wrong += check_compiled(options, blocks, folder)
    wrong = [text for text in wrong if text]
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
