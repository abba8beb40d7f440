"""Carom for Conan 2: conan create packaging/conan --build=missing -s compiler.cppstd=20

The recipe builds the sources that it lies in. ConanCenter has neither libmysofa nor MUMPS: there are no measured heads
for binaural listeners, and modes of solids are computed ten times as slowly as with MUMPS.
"""

import os
import re

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load, rmdir
from conan.tools.gnu import PkgConfigDeps

required_conan_version = ">=2.0"


class CaromRecipe(ConanFile):
    name = "carom"
    description = "Physically based contact sound for Bullet"
    license = "Zlib"
    topics = ("sound", "audio", "physics", "bullet")
    package_type = "static-library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"fPIC": [True, False], "modal": [True, False]}
    default_options = {"fPIC": True, "modal": True}

    @property
    def _repository(self):
        return os.path.join(self.recipe_folder, "..", "..")

    def set_version(self):
        project = load(self, os.path.join(self._repository, "CMakeLists.txt"))
        self.version = re.search(r"project\(carom VERSION ([0-9.]+)", project).group(1)

    def export_sources(self):
        copy(self, "*", self._repository, self.export_sources_folder,
             excludes=["build/*", "out/*", ".git/*", ".git", "packaging/*"])

    def requirements(self):
        # Headers of Eigen and Bullet are in those of Carom.
        self.requires("eigen/3.4.0", transitive_headers=True)
        self.requires("bullet3/3.25", transitive_headers=True)
        self.requires("highway/1.2.0")
        self.requires("libpng/[>=1.6 <2]")
        self.requires("libsndfile/1.2.2")
        self.requires("sdl/[>=2.26 <3]")
        self.requires("zstd/[>=1.5 <2]")
        if self.options.modal:
            self.requires("assimp/[>=5.2 <6]")
            self.requires("meshoptimizer/[>=0.18 <1]")
            self.requires("nlohmann_json/[>=3.9 <4]")

    def build_requirements(self):
        self.tool_requires("cmake/[>=3.25 <5]")
        if not self.conf.get("tools.gnu:pkg_config", check_type=str):
            self.tool_requires("pkgconf/[>=2.0 <3]")

    def validate(self):
        check_min_cppstd(self, 20)
        if self.settings.os != "Linux":
            raise ConanInvalidConfiguration("Carom is built on Linux, and nowhere else so far")
        if self.dependencies["bullet3"].options.get_safe("double_precision"):
            raise ConanInvalidConfiguration("this recipe builds Carom for Bullet in single precision: bullet3/*:double_precision=False")

    def layout(self):
        cmake_layout(self)

    def generate(self):
        CMakeDeps(self).generate()
        PkgConfigDeps(self).generate()
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["CAROM_INSTALL"] = True
        toolchain.cache_variables["CAROM_MODAL"] = bool(self.options.modal)
        for part in ("HRTF", "LISTEN", "MUMPS", "PYBULLET_PLUGIN", "SCENES", "SHARED_C_API", "TESTS"):
            toolchain.cache_variables[f"CAROM_{part}"] = False
        toolchain.cache_variables["CMAKE_UNITY_BUILD"] = True
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        CMake(self).install()
        # CMakeDeps and PkgConfigDeps make these anew, for where the libraries are.
        for folder in ("lib/cmake", "lib/pkgconfig", "share"):
            rmdir(self, os.path.join(self.package_folder, folder))

    def package_info(self):
        self.cpp_info.set_property("cmake_file_name", "carom")
        above = {
            "audio": ["eigen::eigen", "highway::highway", "libpng::libpng", "libsndfile::libsndfile", "zstd::zstd"],
            "native": ["audio", "highway::highway"],
            "bullet": ["audio", "bullet3::bullet3"],
            "plugin": ["audio", "bullet", "sdl::sdl"],
        }
        if self.options.modal:
            above["modal"] = ["audio", "assimp::assimp", "meshoptimizer::meshoptimizer", "nlohmann_json::nlohmann_json"]
        for name, requires in above.items():
            component = self.cpp_info.components[name]
            component.set_property("cmake_target_name", f"carom::{name}")
            component.set_property("pkg_config_name", f"carom-{name}")
            component.libs = [f"carom_{name}"]
            component.requires = requires
            component.system_libs = ["m", "pthread"]
