class Restage < Formula
  desc "Correspondence-free retargeting of human motion"
  homepage "ADDRESS"
  license "Apache-2.0"
  head "ADDRESS", branch: "main" # 0.2.0

  depends_on "cmake" => :build
  depends_on "ninja" => :build
  depends_on "pkgconf" => :build
  depends_on "cli11" => :build
  depends_on "nlohmann-json" => :build
  depends_on "nanoflann" => :build
  depends_on "stb" => :build
  depends_on arch: :x86_64
  depends_on "assimp"
  depends_on "curl"
  depends_on "eigen"
  depends_on "fmt"
  depends_on "giflib"
  depends_on "hdf5"
  depends_on "highway"
  depends_on "liblo"
  depends_on "libwebsockets"
  depends_on "libzip"
  depends_on :linux
  depends_on "openssl@3"
  depends_on "spdlog"
  depends_on "tbb"
  depends_on "tinygltf"
  depends_on "webp"
  depends_on "xz"
  depends_on "yaml-cpp"
  depends_on "zlib"

  def install
    system "cmake", "-S", ".", "-B", "build", "-G", "Ninja", "-DRESTAGE_TESTS=OFF", "-DRESTAGE_PYTHON=OFF",
                    "-DRESTAGE_ASSIMP=ON", *std_cmake_args
    system "cmake", "--build", "build"
    system "cmake", "--install", "build"
  end

  test do
    system bin/"restage", "doctor", "--self"
  end
end
