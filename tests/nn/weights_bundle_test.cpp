// Weights files with all stages: models and sizes come back; what is missing or wrong is named.
#include <gtest/gtest.h>

#include "nn/weights/bundle.h"
#include "nn/weights/state.h"

namespace restage {
namespace {

ModelSet small_set() {
  ModelSizes extractor, motion;
  extractor.points = 64;
  extractor.width = 16;
  extractor.layers = 1;
  extractor.centres = 8;
  extractor.neighbours = 4;
  motion.hidden = 8;
  motion.standardise = true;
  const Init init{{7, 1}, DType::f32};
  ModelSet set;
  put_model(&set, "skeleton/patch_transformer", extractor,
            make_model("skeleton/patch_transformer", extractor, init));
  put_model(&set, "smrm/rot6d", motion, make_model("smrm/rot6d", motion, init));
  put_model(&set, "deformation/weights", {}, make_model("deformation/weights", {}, init));
  put_model(&set, "deformation/offsets", {}, make_model("deformation/offsets", {}, init));
  set.extra["translation"] = "velocity";
  set.smrm->joint_mean = Tensor::full({66}, 0.5);
  return set;
}

constexpr NeededModels kAll{true, true, true};

void expect_bad(const TensorFile& file, const std::string& part, const NeededModels& needs = kAll) {
  try {
    models_of(file, needs, "w.safetensors");
    ADD_FAILURE() << "accepted, expected: " << part;
  } catch (const InputError& e) {
    const std::string what = e.what();
    EXPECT_NE(what.find(part), std::string::npos) << what;
    EXPECT_EQ(what.find("w.safetensors: "), 0u) << what;
    EXPECT_LT(what.size(), 400u);
  }
}

/// The file with one piece of its description replaced.
TensorFile edited(const std::string& from, const std::string& to) {
  TensorFile file = to_file(small_set());
  std::string& text = file.metadata["restage"];
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << text;
  text.replace(at, from.size(), to);
  return file;
}

TEST(WeightsBundle, EverythingComesBack) {
  const ModelSet set = small_set();
  const TensorFile file = to_file(set);
  for (const char* name : {"skeleton.vote.weight", "smrm.enc.weight_ih_l0", "smrm.joint_mean",
                           "deformation.weights.fc1.weight", "deformation.offsets.fc3.bias"})
    EXPECT_NE(file.find(name), nullptr) << name;
  const std::string path = testing::TempDir() + "restage_bundle.safetensors";
  save_models(path, set);
  const ModelSet back = load_models(path, kAll);
  EXPECT_EQ(safetensors_bytes(to_file(back)), safetensors_bytes(file));
  EXPECT_EQ(back.skeleton.name, "skeleton/patch_transformer");
  EXPECT_EQ(back.skeleton->points(), 64);
  EXPECT_EQ(back.smrm->config.hidden, 8);
  EXPECT_EQ(back.extra.at("translation"), "velocity");
  EXPECT_EQ(back.smrm->joint_mean.item(3), 0.5);
  EXPECT_FALSE(back.root);
  EXPECT_EQ(back.smrm.sizes.dropout, 0.2);  // the default, written out
}

TEST(WeightsBundle, MissingStagesAreNamedIfNeeded) {
  ModelSet set = small_set();
  set.smrm = {};
  const TensorFile file = to_file(set);
  EXPECT_TRUE(models_of(file, {true, false, true}, "w").skeleton);
  expect_bad(file, "no model for smrm");
  ModelSet no_offsets = small_set();
  no_offsets.offsets = {};
  EXPECT_TRUE(models_of(to_file(no_offsets), kAll, "w").weights);
}

TEST(WeightsBundle, FilesFromElsewhereAreRefused) {
  TensorFile file = to_file(small_set());
  file.metadata.clear();
  expect_bad(file, "does not say which models");
  file.metadata["restage"] = "{";
  expect_bad(file, "unknown format");
  file.metadata["restage"] = R"({"format":2,"models":{}})";
  expect_bad(file, "unknown format");
}

TEST(WeightsBundle, WrongModelsSizesAndTensorsAreRefused) {
  expect_bad(edited("skeleton/patch_transformer", "skeleton/pointnet"),
             "does not fit skeleton/pointnet");
  expect_bad(edited("skeleton/patch_transformer", "smrm/rot6d"), "no model for skeleton");
  expect_bad(edited("skeleton/patch_transformer", "skeleton/unheard_of"), "no model for skeleton");
  expect_bad(edited("\"hidden\":8", "\"hidden\":9"), "does not fit smrm/rot6d");
  expect_bad(edited("\"hidden\":8", "\"hidden\":2000000000"), "cannot fill");
  expect_bad(edited("\"hidden\":8", "\"hidden\":4611686018427387904"), "cannot fill");
  expect_bad(edited("\"hidden\":8", "\"hidden\":\"x\""), "no proper size");
  expect_bad(edited("\"layers\":1", "\"layers\":100000000"), "cannot fill");
  TensorFile file = to_file(small_set());
  file.tensors["stray"] = Tensor::zeros({1});
  expect_bad(file, "belong to no model");
  file = to_file(small_set());
  file.tensors.erase("smrm.dec.bias_hh_l1");
  expect_bad(file, "'smrm.dec.bias_hh_l1'");
}

TEST(WeightsBundle, SingleModelsGoOutAndIn) {
  const ModelSet set = small_set();
  const TensorFile alone = export_model(set, "smrm", "w");
  EXPECT_NE(alone.find("enc.weight_ih_l0"), nullptr);
  ModelSet other;
  import_model(&other, "smrm/rot6d", exported_sizes(alone, "w"), alone, "w");
  EXPECT_EQ(safetensors_bytes(export_model(other, "smrm/rot6d", "w")), safetensors_bytes(alone));
  EXPECT_THROW(export_model(set, "discriminator", "w"), InputError);
  EXPECT_THROW(import_model(&other, "smrm/rot7d", {}, alone, "w"), InputError);
  EXPECT_THROW(import_model(&other, "smrm/quaternion", {}, alone, "w"), StateError);
  for (const std::string name :
       {"smrm/discriminator", "deformation/v1_field", "deformation/root"}) {
    const auto net = make_model(name, {}, Init{});
    import_model(&other, name, {}, to_file(*net), "w");
    EXPECT_EQ(to_file(models_of(to_file(other), {}, "w")).tensors.size(),
              to_file(other).tensors.size());
  }
}

TEST(WeightsBundle, SizesAreSetByName) {
  ModelSizes s;
  set_size(&s, "hidden", "256");
  set_size(&s, "standardise", "true");
  set_size(&s, "dropout", "0.1");
  EXPECT_EQ(s.hidden, 256);
  EXPECT_TRUE(s.standardise);
  EXPECT_EQ(s.dropout, 0.1);
  EXPECT_THROW(set_size(&s, "hiden", "256"), InputError);
  EXPECT_THROW(set_size(&s, "hidden", "many"), InputError);
  EXPECT_THROW(set_size(&s, "hidden", "true"), InputError);
}

}  // namespace
}  // namespace restage
