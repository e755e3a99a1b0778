"""The files for package managers (cmake/ports, cmake/package/debian): each can be read, and names this version and every library of
CMakeLists.txt.

None of them is run. A reader that is missing here (ruby, PyYAML) leaves out that check.
"""
import ast
import importlib.util
import json
import pathlib
import re
import shutil
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PORTS = ROOT / "cmake/ports"
CMAKE = (ROOT / "CMakeLists.txt").read_text()
VERSION = re.search(r"project\(restage VERSION ([\d.]+)", CMAKE)[1]
FILES = {"vcpkg": "vcpkg/restage/vcpkg.json", "spack": "spack/restage/package.py", "conda": "conda/recipe.yaml",
         "homebrew": "homebrew/restage.rb", "debian": "../package/debian/control"}
# A library as CMake finds it, and its name in each package manager, in the order of FILES.
NAMES = {
    "Eigen3": ("eigen3", "eigen", "eigen", "eigen", "libeigen3-dev"),
    "TBB": ("tbb", "intel-oneapi-tbb", "tbb-devel", "tbb", "libtbb-dev"),
    "HDF5": ("hdf5", "hdf5", "hdf5", "hdf5", "libhdf5-dev"),
    "yaml-cpp": ("yaml-cpp", "yaml-cpp", "yaml-cpp", "yaml-cpp", "libyaml-cpp-dev"),
    "spdlog": ("spdlog", "spdlog", "spdlog", "spdlog", "libspdlog-dev"),
    "nlohmann_json": ("nlohmann-json", "nlohmann-json", "nlohmann_json", "nlohmann-json", "nlohmann-json3-dev"),
    "CLI11": ("cli11", "cli11", "cli11", "cli11", "libcli11-dev"),
    "LibLZMA": ("liblzma", "xz", "liblzma-devel", "xz", "liblzma-dev"),
    "ZLIB": ("zlib", "zlib-api", "zlib", "zlib", "zlib1g-dev"),
    "libzip": ("libzip", "libzip", "libzip", "libzip", "libzip-dev"),
    "liblo": ("liblo", "liblo", "liblo", "liblo", "liblo-dev"),
    "libwebsockets": ("libwebsockets", "libwebsockets", "libwebsockets", "libwebsockets", "libwebsockets-dev"),
    "libwebpmux": ("libwebp", "libwebp", "libwebp", "webp", "libwebp-dev"),
    "libwebp": ("libwebp", "libwebp", "libwebp", "webp", "libwebp-dev"),
    "GIF": ("giflib", "giflib", "giflib", "giflib", "libgif-dev"),
    "TinyGLTF": ("tinygltf", "tinygltf", "tinygltf", "tinygltf", "libtinygltf-dev"),
    "OpenSSL": ("openssl", "openssl", "openssl", "openssl@3", "libssl-dev"),
    "CURL": ("curl", "curl", "libcurl", "curl", "libcurl4-openssl-dev"),
    "hwy": ("highway", "highway", "libhwy", "highway", "libhwy-dev"),
    "assimp": ("assimp", "assimp", "assimp", "assimp", "libassimp-dev"),
}
NOT_LIBRARIES = {"PkgConfig", "Git"}
OPTIONAL = {"MPI", "CUDAToolkit", "GTest"}  # off, or for tests


def wanted():
    """The libraries of CMakeLists.txt, as CMake finds them."""
    found = set(re.findall(r"find_package\((\S+)", CMAKE))
    for words in re.findall(r"pkg_check_modules\(\S+ (?:REQUIRED|QUIET) IMPORTED_TARGET ([^)]*)\)", CMAKE):
        found |= {word.split(">=")[0] for word in words.split()}
    return found - NOT_LIBRARIES - OPTIONAL


class PortsTest(unittest.TestCase):
    def test_libraries(self):
        self.assertEqual(wanted(), set(NAMES), "CMakeLists.txt and NAMES here differ")
        for place, (manager, file) in enumerate(FILES.items()):
            text = (PORTS / file).read_text()
            for library, names in NAMES.items():
                self.assertRegex(text, rf"[\" ]{re.escape(names[place])}[\"@ ,~\n]", f"{manager} lacks {library}")

    def test_version(self):
        for manager, file in FILES.items():
            self.assertIn(VERSION, (PORTS / file).read_text(), manager)
        self.assertTrue((PORTS / "../package/debian/changelog").read_text().startswith(f"restage ({VERSION}-"))

    def test_json_and_python(self):
        self.assertEqual(json.loads((PORTS / FILES["vcpkg"]).read_text())["version"], VERSION)
        ast.parse((PORTS / FILES["spack"]).read_text())

    @unittest.skipUnless(importlib.util.find_spec("yaml"), "PyYAML is missing")
    def test_yaml(self):
        import yaml
        self.assertEqual(yaml.safe_load((PORTS / FILES["conda"]).read_text())["package"]["version"], VERSION)

    @unittest.skipUnless(shutil.which("ruby"), "ruby is missing")
    def test_ruby(self):
        done = subprocess.run(["ruby", "-c", PORTS / FILES["homebrew"]], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_options(self):
        """Options that the files give exist."""
        known = set(re.findall(r"(?:option|set)\((RESTAGE_\w+)", CMAKE)) | {"RESTAGE_PYTHON_DIR"}
        for path in PORTS.rglob("*"):
            if path.is_file() and path.suffix != ".md":
                self.assertLessEqual(set(re.findall(r"RESTAGE_[A-Z_]+", path.read_text())), known, path.name)


if __name__ == "__main__":
    unittest.main()
