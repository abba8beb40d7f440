#!/usr/bin/env python3
"""Checks the recipes in packaging/ without vcpkg and Conan: with stand-ins for what they call, the version, the names of
options, which CMake is then given, and the libraries that they tell.

    python3 tests/install/recipes.py SOURCE FOLDER COMPONENT...
"""

import collections
import json
import os
import re
import subprocess
import sys
import types

PORT = """
set(CURRENT_PACKAGES_DIR "@FOLDER@/packages")
set(FEATURES core modal)
macro(vcpkg_check_linkage)
endmacro()
function(vcpkg_check_features)
  cmake_parse_arguments(ARG "" "OUT_FEATURE_OPTIONS" "FEATURES" ${ARGN})
  list(GET ARG_FEATURES 0 feature)
  list(GET ARG_FEATURES 1 option)
  if(NOT feature STREQUAL "modal")
    message(FATAL_ERROR "feature ${feature} is not in vcpkg.json")
  endif()
  set(${ARG_OUT_FEATURE_OPTIONS} -D${option}=ON PARENT_SCOPE)
endfunction()
macro(vcpkg_find_acquire_program name)
  set(${name} "pkg-config")
endmacro()
function(vcpkg_cmake_configure)
  cmake_parse_arguments(ARG "" "SOURCE_PATH" "OPTIONS" ${ARGN})
  execute_process(COMMAND ${CMAKE_COMMAND} -G Ninja -S ${ARG_SOURCE_PATH} -B @FOLDER@/port ${ARG_OPTIONS} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
foreach(later cmake_install cmake_config_fixup fixup_pkgconfig)
  function(vcpkg_${later})
  endfunction()
endforeach()
function(vcpkg_install_copyright)
  cmake_parse_arguments(ARG "" "" "FILE_LIST" ${ARGN})
  if(NOT EXISTS ${ARG_FILE_LIST})
    message(FATAL_ERROR "${ARG_FILE_LIST} does not exist")
  endif()
endfunction()
include(@SOURCE@/packaging/vcpkg/carom/portfile.cmake)
"""


def unique(pairs):
    """A JSON object without one key twice."""
    keys = [key for key, value in pairs]
    assert len(keys) == len(set(keys)), f"keys twice: {keys}"
    return dict(pairs)


def check_port(source, folder, version):
    """Reads the manifest, and configures Carom as the port does. Returns the cache that CMake leaves."""
    with open(f"{source}/packaging/vcpkg/carom/vcpkg.json", encoding="utf-8") as file:
        manifest = json.load(file, object_pairs_hook=unique)
    assert manifest["version-semver"] == version, f"vcpkg.json is of {manifest['version-semver']}, CMakeLists.txt of {version}"
    assert list(manifest["features"]) == ["modal"], "the stand-in knows one feature"
    script = f"{folder}/port.cmake"
    os.makedirs(folder, exist_ok=True)
    with open(script, "w", encoding="utf-8") as file:
        file.write(PORT.replace("@FOLDER@", folder).replace("@SOURCE@", source))
    run = subprocess.run(["cmake", "-P", script], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "not used by the project" not in run.stderr, run.stderr
    with open(f"{folder}/port/CMakeCache.txt", encoding="utf-8") as file:
        return file.read()


class Anything:
    """What takes all calls."""

    def __init__(self, *arguments):
        self.cache_variables = {}
        made.append(self)

    def __getattr__(self, name):
        return lambda *arguments, **options: None


made = []


def stand_in_for_conan():
    def module(name, **contents):
        sys.modules[name] = types.ModuleType(name)
        vars(sys.modules[name]).update(contents)

    def load(recipe, path):
        with open(path, encoding="utf-8") as file:
            return file.read()

    recipe = type("ConanFile", (), {})
    module("conan", ConanFile=recipe)
    module("conan.errors", ConanInvalidConfiguration=Exception)
    module("conan.tools")
    module("conan.tools.build", check_min_cppstd=lambda *a: None, can_run=lambda *a: False)
    module("conan.tools.cmake", CMake=Anything, CMakeDeps=Anything, CMakeToolchain=Anything, cmake_layout=lambda *a: None)
    module("conan.tools.files", copy=lambda *a, **o: None, load=load, rmdir=lambda *a: None)
    module("conan.tools.gnu", PkgConfigDeps=Anything)


def check_conan(source, version, cache, components):
    """Has the recipe say what it does, and compares that with the project."""
    stand_in_for_conan()
    names = {}
    path = f"{source}/packaging/conan/conanfile.py"
    with open(path, encoding="utf-8") as file:
        exec(compile(file.read(), path, "exec"), names)
    with open(f"{source}/packaging/conan/test_package/conanfile.py", encoding="utf-8") as file:
        compile(file.read(), "test_package", "exec")

    recipe = names["CaromRecipe"]()
    recipe.recipe_folder = os.path.dirname(path)
    recipe.options = types.SimpleNamespace(fPIC=True, modal=True)
    recipe.set_version()
    assert recipe.version == version, f"the recipe finds version {recipe.version}"

    required = []
    recipe.requires = lambda reference, **traits: required.append(reference.split("/")[0])
    recipe.requirements()

    recipe.generate()
    for option in made[-1].cache_variables:
        assert re.search(f"^{option}:", cache, re.M), f"the recipe sets {option}, which the project does not have"

    recipe.cpp_info = types.SimpleNamespace(set_property=lambda *a: None, components=collections.defaultdict(Anything))
    recipe.package_info()
    told = recipe.cpp_info.components
    assert sorted(told) == sorted(components), f"the recipe tells of {sorted(told)}, installed are {sorted(components)}"
    for name, component in told.items():
        assert component.libs == [f"carom_{name}"]
        for need in component.requires:
            assert need in told or need.split("::")[0] in required, f"{name} needs {need}, which is not required"


def main():
    source, folder, *components = sys.argv[1:]
    with open(f"{source}/CMakeLists.txt", encoding="utf-8") as file:
        version = re.search(r"project\(carom VERSION ([0-9.]+)", file.read()).group(1)
    cache = check_port(source, folder, version)
    check_conan(source, version, cache, components)
    print("the recipes say what the project is")


if __name__ == "__main__":
    main()
