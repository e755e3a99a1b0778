// Every model, layer and loss against the oracle's numbers (tests/golden/oracle), values and
// gradients, in float64 and float32; and the measure itself.
#include <gtest/gtest.h>

#include <filesystem>

#include "autograd/base/error.h"
#include "tests/oracle/oracle_case.h"

namespace restage::oracle {
namespace {

std::string folder() { return std::string(RESTAGE_SOURCE_DIR) + "/tests/golden/oracle/"; }

std::vector<std::string> cases() {
  std::vector<std::string> out;
  for (const auto& entry : std::filesystem::directory_iterator(folder())) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() == ".safetensors" && name != "adam_f64" && name != "full_size")
      out.push_back(name);
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::string report(const std::vector<Difference>& differences) {
  std::string out;
  for (const Difference& d : differences) out += d.name + " " + std::to_string(d.error) + "\n";
  return out;
}

class OracleGolden : public testing::TestWithParam<std::string> {};

TEST_P(OracleGolden, AgreesInValuesAndGradients) {
  const std::string path = folder() + GetParam() + ".safetensors";
  const TensorFile question = read_safetensors(path);
  const bool f64 = question.metadata.at("dtype") == "f64";
  const std::vector<Difference> found =
      differences(question, answer(question, path), f64 ? 1e-8 : 1e-4);
  EXPECT_TRUE(found.empty()) << report(found);
}

INSTANTIATE_TEST_SUITE_P(Cases, OracleGolden, testing::ValuesIn(cases()),
                         [](const auto& param) { return param.param; });

TEST(OracleMeasure, AllCasesArePresent) { EXPECT_EQ(cases().size(), 42u); }

TEST(OracleMeasure, NoticesWhatDiffersOrIsMissing) {
  const std::string path = folder() + "gru_f64.safetensors";
  const TensorFile question = read_safetensors(path);
  TensorFile reply = answer(question, path);
  ASSERT_TRUE(differences(question, reply, 1e-8).empty());
  Tensor changed = reply.at("g.weight_hh_l1", "reply").clone();
  changed.data<double>()[3] += 1e-5;
  reply.tensors["g.weight_hh_l1"] = changed;
  reply.tensors.erase("g.in.h0");
  const std::vector<Difference> found = differences(question, reply, 1e-8);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].name, "g.in.h0");
  EXPECT_EQ(found[1].name, "g.weight_hh_l1");
  EXPECT_GT(found[1].error, 1e-7);
}

TEST(OracleMeasure, UnknownOrIncompleteCasesAreBadInput) {
  const std::string path = folder() + "gru_f64.safetensors";
  TensorFile question = read_safetensors(path);
  question.tensors.erase("p.bias_hh_l0");
  EXPECT_THROW(answer(question, path), InputError);
  question.metadata["case"] = "gr";
  EXPECT_THROW(answer(question, path), InputError);
  question.metadata.erase("dtype");
  EXPECT_THROW(answer(question, path), InputError);
}

}  // namespace
}  // namespace restage::oracle
