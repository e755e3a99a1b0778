from spack.package import *


class Restage(CMakePackage):
    """Correspondence-free retargeting of human motion: a target performs the motion of a sequence of point clouds."""

    git = "ADDRESS"
    license("Apache-2.0")

    version("main", branch="main")  # 0.2.0

    variant("fbx", default=True, description="FBX characters (Assimp)")
    variant("mpi", default=False, description="training by several processes")
    variant("cuda", default=False, description="training on a GPU")

    requires("target=x86_64:", msg="Restage runs on x86-64 processors")
    requires("platform=linux", msg="Restage runs on Linux")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("cli11", type="build")
    depends_on("nlohmann-json", type="build")
    depends_on("nanoflann", type="build")
    depends_on("stb", type="build")
    depends_on("eigen@3.4:")
    depends_on("intel-oneapi-tbb")
    depends_on("highway")
    depends_on("hdf5~mpi")
    depends_on("yaml-cpp")
    depends_on("spdlog")
    depends_on("fmt")
    depends_on("xz")
    depends_on("zlib-api")
    depends_on("libzip")
    depends_on("liblo")
    depends_on("libwebsockets")
    depends_on("libwebp")
    depends_on("giflib@5:")
    depends_on("tinygltf")
    depends_on("openssl")
    depends_on("curl")
    depends_on("assimp@5.2:", when="+fbx")
    depends_on("mpi", when="+mpi")
    depends_on("cuda", when="+cuda")

    generator("ninja")

    def cmake_args(self):
        return [
            self.define("RESTAGE_TESTS", False),
            self.define("RESTAGE_PYTHON", False),
            self.define_from_variant("RESTAGE_ASSIMP", "fbx"),
            self.define_from_variant("RESTAGE_MPI", "mpi"),
            self.define_from_variant("RESTAGE_CUDA", "cuda"),
        ]
