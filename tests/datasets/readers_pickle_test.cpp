// Pickles that are read without running anything: what is understood, what is refused, by its name.
#include <gtest/gtest.h>
#include <zlib.h>

#include "datasets/readers/arrays/nested_file.h"
#include "datasets/readers/arrays/pickle.h"
#include "tests/datasets/pickle_support.h"
#include "tests/support/files.h"

namespace restage {
namespace {

using namespace test;
namespace p = test::pickle;
using Kind = ValueTree::Kind;
using ReadersPickle = FileTest;

ValueTree tree_of(const std::string& bytes, uint64_t max_memory = kMaxMemory) {
  ValueTree out("x.pkl");
  read_pickle(bytes, {max_memory, {}}, out);
  return out;
}
std::string why(const std::string& bytes) {
  return error_of([&] { tree_of(bytes); });
}

std::vector<double> values(const SharedArray& array) { return array->read().finite(); }

TEST_F(ReadersPickle, ContainersNumbersAndText) {
  const ValueTree t = tree_of(p::file(p::map(
      {{p::text("a"), "K\x05"},
       {p::text("b"), p::list({"N", "\x88", "M\x01\x02", std::string("G\x3f\xe0\0\0\0\0\0\0", 9)})},
       {p::number(7), p::tuple({p::text("é"), std::string("\x8a\x02\0\xff", 4)})},
       {"V\\u00e9x\n", "F1.5\n"},
       {"S'it\\x41'\n", "I01\n"}})));
  EXPECT_EQ(t.number(t.find(t.root, "a")), 5);
  const std::vector<ValueTree::Id> b = t.items(t.find(t.root, "b"));
  EXPECT_EQ(t.kind(b[0]), Kind::none);
  EXPECT_EQ(t.kind(b[1]), Kind::truth);
  EXPECT_EQ(t.number(b[2]), 513);
  EXPECT_EQ(t.number(b[3]), 0.5);
  EXPECT_EQ(t.text(t.items(t.find(t.root, "7"))[0]), "é");
  EXPECT_EQ(t.number(t.items(t.find(t.root, "7"))[1]), -256);
  EXPECT_EQ(t.number(t.find(t.root, "éx")), 1.5);
  EXPECT_EQ(t.number(t.find(t.root, "itA")), 1);
  EXPECT_EQ(t.find(t.root, "none"), t.none());
}

TEST_F(ReadersPickle, ArraysOfNumpy) {
  const ValueTree t = tree_of(p::file(p::map(
      {{p::text("c"), p::array({2, 2}, {1, 2, 3, 4})},
       {p::text("f"), p::array({2, 2}, {1, 2, 3, 4}, true)},
       {p::text("one"), p::objects({}, {p::map({{p::text("x"), p::array({1}, {9})}})})},
       {p::text("many"), p::objects({2}, {p::number(1), p::number(2)})},
       {p::text("scalar"),
        p::call(p::name("numpy._core.multiarray", "scalar"), {p::type("f8"), p::bytes(raw(2.5))})},
       {p::text("buffer"),
        p::call(p::name("numpy.core.numeric", "_frombuffer"),
                {p::bytes(raw(7.0)), p::type("f8"), p::shape({1}), p::text("C")})},
       {p::text("latin"), p::state({1}, "f8", false,
                                   p::call(p::name("_codecs", "encode"),
                                           {p::text(std::string("\0\0\0\0\0\0\xc3\xb0\x3f", 9)),
                                            p::text("latin1")}))},
       {p::text("dates"), p::state({1}, "M8", false, p::bytes("12345678"))}})));
  const auto array = [&](const char* key) { return t.array(t.find(t.root, key)); };
  EXPECT_EQ(values(array("c")), (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(values(array("f")), (std::vector<double>{1, 3, 2, 4}));
  EXPECT_EQ(array("f")->read().part(1)[0], 2);
  EXPECT_EQ(values(array("scalar")), std::vector<double>{2.5});
  EXPECT_EQ(values(array("buffer")), std::vector<double>{7});
  EXPECT_EQ(values(array("latin")), std::vector<double>{1});
  const ValueTree::Id one = t.find(t.root, "one");
  ASSERT_EQ(t.kind(one), Kind::map);
  EXPECT_EQ(values(t.array(t.find(one, "x"))), std::vector<double>{9});
  EXPECT_EQ(t.items(t.find(t.root, "many")).size(), 2u);
  EXPECT_EQ(t.kind(t.find(t.root, "dates")), Kind::other);  // no fault of the rest
}

TEST_F(ReadersPickle, MemoAndContainersThatHoldThemselves) {
  const ValueTree t =
      tree_of(std::string("\x80\x02]q\0(h\0K\x01"
                          "e.",
                          12));
  EXPECT_EQ(t.items(t.root)[0], t.root);
  EXPECT_EQ(t.items(t.root).size(), 2u);
}

TEST_F(ReadersPickle, WhatItAsksToRunIsNamed) {
  const std::string evil = p::file(p::call(p::name("os", "system"), {p::text("touch x")}));
  EXPECT_EQ(
      why(evil),
      "x.pkl: asks to run 'os.system'; a pickle may do anything, so only arrays are read: save "
      "the arrays alone with numpy.savez");
  EXPECT_HAS(why(p::file(p::text("posix") + p::text("system") + "\x93")), "'posix.system'");
  EXPECT_HAS(why("(S'id'\nios\nsystem\n."), "'os.system'");
  EXPECT_HAS(why(p::file(p::name("builtins", "eval"))), "'builtins.eval'");
  EXPECT_HAS(why(p::file("P1\n")), "a persistent id");
  EXPECT_HAS(why(p::file("\x82\x01")), "an extension");
  EXPECT_HAS(why(p::file(p::name("numpy", "ndarray") + ")R")), "'numpy.ndarray'");
}

TEST_F(ReadersPickle, DamageIsNamed) {
  for (const std::string& bytes :
       {std::string(), std::string("\x80\x02"), p::file("0"), p::file("e"), p::file("h\x05"),
        p::file("}K\x01s"), p::file("\xff"), p::file("X\xff\xff\xff\xff"),
        p::file("\x8e" + raw(~0ull)), p::file(p::state({2}, "f8", false, p::bytes("1234"))),
        p::file("K\x01K\x02R"), p::file("p-1\n"),
        p::file(p::state({1 << 30, 1 << 30, 1 << 30}, "f8", false, p::bytes("")))}) {
    try {
      const ValueTree t = tree_of(bytes);
      EXPECT_EQ(t.kind(t.root), Kind::other) << bytes;  // an array that cannot be
    } catch (const InputError& error) {
      EXPECT_HAS(std::string(error.what()), "x.pkl: ");
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

TEST_F(ReadersPickle, MemoryIsBounded) {
  const std::string large = p::file(p::array({1000}, std::vector<double>(1000, 1)));
  EXPECT_HAS(error_of([&] { tree_of(large, 10000); }), "max_memory");
  tree_of(large, 100000);
  EXPECT_HAS(error_of([&] { tree_of(p::file(std::string(100000, 'N')), 100000); }), "max_memory");
}

TEST_F(ReadersPickle, JoblibsArraysLieBetween) {
  const std::string bytes = p::file(
      p::map({{p::text("pose"), p::joblib_array({2, 2}, {1, 2, 3, 4})}, {p::text("n"), "K\x02"}}));
  const auto check = [&](const std::string& path) {
    const ValueTree t = read_nested_file(path);
    EXPECT_EQ(values(t.array(t.find(t.root, "pose"))), (std::vector<double>{1, 2, 3, 4}));
    EXPECT_EQ(t.number(t.find(t.root, "n")), 2);
  };
  check(dir.write("a.pkl", bytes));
  std::string packed(compressBound(bytes.size()), '\0');
  uLongf size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  check(dir.write("b.joblib", packed.substr(0, size)));
  EXPECT_HAS(error_of([&] { read_nested_file(dir.write("c.pkl", packed.substr(0, size / 2))); }),
             "cut short");
  EXPECT_HAS(error_of([&] { read_nested_file(dir.write("d.pkl", "BZh9")); }), "bzip2");
  EXPECT_HAS(error_of([&] { read_nested_file(dir.write("b.pkl", packed.substr(0, size)), 50); }),
             "max_memory");
}

TEST_F(ReadersPickle, TensorsOfTorch) {
  const std::string value = p::map({{p::text("a"), p::tensor("0", 6, 0, {2, 3}, {3, 1})},
                                    {p::text("turned"), p::tensor("0", 6, 0, {3, 2}, {1, 3})},
                                    {p::text("part"), p::tensor("0", 6, 4, {2}, {1})},
                                    {p::text("same"), p::tensor("1", 1, 0, {3}, {0})}});
  const std::vector<std::vector<double>> storages = {{1, 2, 3, 4, 5, 6}, {8}};
  const ValueTree t = read_nested_file(dir.write("a.pt", p::torch_file(value, storages)));
  const auto of = [&](const char* key) { return values(t.array(t.find(t.root, key))); };
  EXPECT_EQ(of("a"), (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(of("turned"), (std::vector<double>{1, 4, 2, 5, 3, 6}));
  EXPECT_EQ(of("part"), (std::vector<double>{5, 6}));
  EXPECT_EQ(of("same"), (std::vector<double>{8, 8, 8}));
  const auto refused = [&](const std::string& tensor) {
    return error_of([&] { read_nested_file(dir.write("b.pt", p::torch_file(tensor, storages))); });
  };
  EXPECT_HAS(refused(p::tensor("0", 6, 5, {2}, {1})), "larger than its storage");
  EXPECT_HAS(refused(p::tensor("0", 6, 0, {2, 3}, {1 << 30, 1 << 30})), "larger than its storage");
  EXPECT_HAS(refused(p::tensor("0", 7, 0, {7}, {1})), "lacks the numbers");
  EXPECT_HAS(refused(p::tensor("9", 1, 0, {1}, {1})), "lacks the numbers");
}

TEST_F(ReadersPickle, OlderFilesOfTorch) {
  const std::string value = p::map({{p::text("a"), p::tensor("0", 2, 0, {2}, {1})}});
  const std::string magic = "\x80\x02\x8A\x0A\x6C\xFC\x9C\x46\xF9\x20\x6A\xA8\x50\x19.";
  const std::string bytes = magic + p::file("M\xe9\x03") + p::file("}") + p::file(value) +
                            p::file(p::list({p::text("0")})) + raw(int64_t{2}) + p::raw_of({3, 4});
  const ValueTree t = read_nested_file(dir.write("old.pth", bytes));
  EXPECT_EQ(values(t.array(t.find(t.root, "a"))), (std::vector<double>{3, 4}));
  EXPECT_HAS(
      error_of([&] { read_nested_file(dir.write("cut.pth", bytes.substr(0, bytes.size() - 4))); }),
      "lacks the numbers");
}

TEST_F(ReadersPickle, ObjectsInNpyAndNpz) {
  const std::string path =
      dir.write("a.npy", p::npy_objects({}, {p::map({{p::text("x"), p::array({1}, {4})}})}));
  EXPECT_TRUE(holds_objects(path));
  const ValueTree t = read_nested_file(path);
  EXPECT_EQ(values(t.array(t.find(t.root, "x"))), std::vector<double>{4});
  const std::string evil = npy_of(npy_header("|O", {}), p::file(p::name("os", "system")));
  dir.write("b.npz", npz({{"r", p::npy_objects({}, {p::map({})})},
                          {"bad", evil},
                          {"n", npy<double>({2}, {1, 2})}}));
  std::optional<InputError> fault;
  const ValueTree all =
      read_nested_arrays(std::make_shared<const Npz>(dir / "b.npz"), kMaxMemory, fault);
  EXPECT_EQ(all.kind(all.find(all.root, "r")), Kind::map);
  EXPECT_EQ(values(all.array(all.find(all.root, "n"))), (std::vector<double>{1, 2}));
  ASSERT_TRUE(fault);
  EXPECT_HAS(std::string(fault->what()), "os.system");
}

}  // namespace
}  // namespace restage
