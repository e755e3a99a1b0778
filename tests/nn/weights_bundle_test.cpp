// Weights files with all stages: models and sizes come back; what is missing or wrong is named.
#include <gtest/gtest.h>

#include <cmath>

#include "autograd/gradcheck/evaluate.h"
#include "nn/models/corenet.h"
#include "nn/models/deformation.h"
#include "nn/models/discriminator.h"
#include "nn/models/h4d.h"
#include "nn/models/hybrid.h"
#include "nn/models/lart.h"
#include "nn/models/npt.h"
#include "nn/models/patch_transformer.h"
#include "nn/models/point_transformer.h"
#include "nn/models/pointnet.h"
#include "nn/models/skeleton.h"
#include "nn/models/smrm.h"
#include "nn/models/tst.h"
#include "nn/weights/bundle.h"
#include "nn/weights/state.h"
#include "tests/support/files.h"
#include "tests/support/small_models.h"

namespace restage {
namespace {

Bundle small_set() {
  const Init init{{7, 1}, DType::f32};
  Bundle set;
  const auto put = [&](const std::string& name, const std::vector<std::string>& sizes,
                       Settings settings = {}) {
    set.put(model_type(name).role, testing::untrained_model(name, sizes, init, settings));
  };
  put("skeleton/patch_transformer",
      {"points=64", "width=16", "layers=1", "centres=8", "neighbours=4"});
  put("smrm/rot6d", {"hidden=8", "standardise=true"}, {{"translation", "velocity"}});
  put("deformation/weights", {});
  put("deformation/offsets", {}, {{"keep_root_rotation", "false"}});
  set.find_as<Smrm>("motion")->joint_mean = Tensor::full({66}, 0.5);
  return set;
}

void expect_bad(const TensorFile& file, const std::string& part) {
  test::expect_refused([&] { bundle_of(file, "w.safetensors"); }, "w.safetensors: ", part);
}

/// The file with one piece of its description replaced.
TensorFile edited(const std::string& from, const std::string& to) {
  TensorFile file = to_file(small_set());
  file.metadata["restage"] = test::replaced(file.metadata["restage"], from, to);
  return file;
}

/// A line of the registry as Python adds it; the network is one of ours.
ModelType from_python(const std::string& help, const std::string& code) {
  ModelType type = model_type("deformation/weights");
  type.name = "mine/of_a_test", type.help = help, type.module = "mine", type.code = code;
  return type;
}

TEST(WeightsBundle, ANetworkOfPythonNamesItsModule) {
  register_own_model(from_python("first", "1"));
  const Init init{{7, 1}, DType::f32};
  Bundle set;
  set.put("deformation.weights", testing::untrained_model("mine/of_a_test", {}, init));
  TensorFile file = to_file(set);
  const std::string said = file.metadata["restage"], first = identity_bytes(set);
  EXPECT_HAS(said, R"("module":"mine")");
  EXPECT_EQ(bundle_of(file, "w.safetensors").need("deformation.weights", "w").model,
            "mine/of_a_test");
  file.metadata["restage"] = test::replaced(said, "mine/of_a_test", "mine/unheard_of");
  expect_bad(file, "needs the network 'mine/unheard_of', which the Python module 'mine' defines");

  register_own_model(from_python("second", "2"));
  EXPECT_EQ(model_type("mine/of_a_test").help, "second");
  EXPECT_NE(identity_bytes(set), first) << "other code is another network";
  EXPECT_THROW(register_model(from_python("third", "3")), Error);
  ModelType ours = from_python("ours", "4");
  ours.name = "smrm/rot6d";
  EXPECT_THROW(register_own_model(ours), Error);
}

TEST(WeightsBundle, EverythingComesBack) {
  const Bundle set = small_set();
  const TensorFile file = to_file(set);
  for (const char* name : {"skeleton.vote.weight", "smrm.enc.weight_ih_l0", "smrm.joint_mean",
                           "deformation.weights.fc1.weight", "deformation.offsets.fc3.bias"})
    EXPECT_NE(file.find(name), nullptr) << name;
  const test::TempDir dir;
  const std::string path = dir / "w.safetensors";
  save_bundle(path, set);
  const Bundle back = load_bundle(path);
  EXPECT_EQ(safetensors_bytes(to_file(back)), safetensors_bytes(file));
  EXPECT_EQ(back.need("skeleton", "w").model, "skeleton/patch_transformer");
  EXPECT_EQ(back.find_as<SkeletonModel>("skeleton")->points(), 64);
  const Smrm& motion = back.need_as<Smrm>("motion", "w");
  EXPECT_EQ(motion.config.hidden, 8);
  EXPECT_EQ(motion.config.dropout, 0.2);  // the default, written out
  EXPECT_EQ(motion.joint_mean.item(3), 0.5);
  EXPECT_EQ(back.need("motion", "w").setting("translation", {"absolute", "velocity"}), "velocity");
  EXPECT_EQ(back.find("deformation.root"), nullptr);
}

TEST(WeightsBundle, RolesAreFoundAsWhatTheyAreUsedFor) {
  Bundle set = small_set();
  EXPECT_NE(set.find_as<DeformationModel>("deformation.weights"), nullptr);
  EXPECT_EQ(set.find_as<MotionModel>("skeleton"), nullptr);
  EXPECT_THROW(set.need_as<MotionModel>("skeleton", "w"), InputError);
  EXPECT_THROW(set.put("motion", set.need("skeleton", "w")), InputError);
  set.erase("motion");
  test::expect_refused([&] { set.need("motion", "w.safetensors"); },
                       "w.safetensors: holds no model for smrm", "");
}

TEST(WeightsBundle, SettingsAreKnownOrRefused) {
  const TrainedModel motion = small_set().need("motion", "w");
  EXPECT_EQ(motion.setting("remove_heading", {"false", "true"}), "false");  // the first, if unsaid
  EXPECT_THROW(motion.setting("translation", {"absolute", "relative"}), InputError);
  expect_bad(edited("\"velocity\"", "7"), "that is no text");
}

/// Files of version 0.1.0 kept the settings of all models together.
TEST(WeightsBundle, OlderFilesAreUnderstood) {
  TensorFile file = to_file(small_set());
  std::string& text = file.metadata["restage"];
  const std::string now = R"(,"settings":{"translation":"velocity"})";
  ASSERT_NE(text.find(now), std::string::npos) << text;
  text.erase(text.find(now), now.size());
  text.insert(text.size() - 1, R"(,"extra":{"translation":"relative","remove_heading":"true"})");
  const TrainedModel motion = bundle_of(file, "w").need("motion", "w");
  EXPECT_EQ(motion.settings.at("translation"), "relative");
  EXPECT_EQ(motion.settings.at("remove_heading"), "true");
  text.insert(text.rfind("}}"), R"(,"gravity":"9.81")");
  expect_bad(file, "'gravity' of no model");
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
  expect_bad(edited("skeleton/patch_transformer", "skeleton/pointnet"), "unknown key 'width'");
  expect_bad(edited("skeleton/patch_transformer", "smrm/rot6d"), "no model for skeleton");
  expect_bad(edited("skeleton/patch_transformer", "skeleton/unheard_of"), "no model for skeleton");
  expect_bad(edited("\"hidden\":8", "\"hidden\":9"), "does not fit smrm/rot6d");
  expect_bad(edited("\"hidden\":8", "\"hidden\":2000000000"), "whole number");
  expect_bad(edited("\"hidden\":8", "\"hidden\":4611686018427387904"), "whole number");
  expect_bad(edited("\"hidden\":8", "\"hidden\":\"x\""), "whole number");
  expect_bad(edited("\"layers\":1", "\"layers\":100000000"), "whole number");
  TensorFile file = to_file(small_set());
  file.tensors["stray"] = Tensor::zeros({1});
  expect_bad(file, "belong to no model");
  file = to_file(small_set());
  file.tensors.erase("smrm.dec.bias_hh_l1");
  expect_bad(file, "'smrm.dec.bias_hh_l1'");
}

TEST(WeightsBundle, SingleModelsGoOutAndIn) {
  const Bundle set = small_set();
  const TensorFile alone = export_model(set, "smrm", "w");
  EXPECT_NE(alone.find("enc.weight_ih_l0"), nullptr);
  EXPECT_EQ(safetensors_bytes(export_model(set, "motion", "w")), safetensors_bytes(alone));
  Bundle other;
  other.put("motion", import_model("smrm/rot6d", {}, alone, "w"));
  EXPECT_EQ(other.need("motion", "w").settings, set.need("motion", "w").settings);
  EXPECT_EQ(safetensors_bytes(export_model(other, "smrm/rot6d", "w")), safetensors_bytes(alone));
  EXPECT_THROW(export_model(set, "discriminator", "w"), InputError);
  EXPECT_THROW(import_model("smrm/rot7d", {}, alone, "w"), InputError);
  EXPECT_THROW(import_model("smrm/quaternion", {}, alone, "w"), StateError);
  for (const std::string name :
       {"smrm/discriminator", "deformation/v1_field", "deformation/root"}) {
    const auto net = make_model(name, model_config(name), Init{});
    other.put(model_type(name).role, import_model(name, {}, to_file(*net), "w"));
    EXPECT_EQ(to_file(bundle_of(to_file(other), "w")).tensors.size(),
              to_file(other).tensors.size());
  }
}

TEST(WeightsBundle, WhatChangesAModelsFunctionIsInItsFile) {
  // The tensors have the same shapes with other heads and scales, so nothing else would tell.
  const std::vector<std::string> sizes = {"points=64",    "width=16",    "layers=1", "centres=8",
                                          "neighbours=4", "memory=true", "looks=2"},
                                 others = {"heads=8", "heads=1", "patch_scale=3", "centre_scale=5",
                                           "memory_scale=0.5"};
  const Init init{{7, 1}, DType::f32};
  SkeletonInput in{Var(Tensor::empty({1, 64, 3}))};
  for (int64_t i = 0; i < 192; ++i)
    in.cloud.value.data<float>()[i] = static_cast<float>(std::sin(static_cast<double>(i * i)));
  in.past = Tensor::full({1, kJoints, 4}, 0.5);
  const auto answer = [&](const Bundle& bundle) {
    Context ctx;
    return bundle.find_as<SkeletonModel>("skeleton")->forward(ctx, in).joints.value;
  };
  const auto bundle = [&](const std::vector<std::string>& with) {
    Bundle out;
    out.put("skeleton", testing::untrained_model("skeleton/patch_transformer", with, init));
    return out;
  };
  const Tensor usual = answer(bundle(sizes));
  for (const std::string& other : others) {
    std::vector<std::string> with = sizes;
    with.push_back(other);
    const Bundle made = bundle(with);
    EXPECT_FALSE(gradcheck::same_bits(answer(made), usual)) << other << " changes nothing";
    EXPECT_TRUE(gradcheck::same_bits(answer(bundle_of(to_file(made), "w")), answer(made))) << other;
  }
  // A file of before has none of these keys: it means what was fixed then.
  TensorFile file = to_file(bundle(sizes));
  std::string& text = file.metadata["restage"];
  for (const char* key : {"\"patch\":64,", "\"heads\":4,", "\"patch_scale\":10,",
                          "\"centre_scale\":2,", "\"memory_scale\":4,"})
    text = test::replaced(text, key, "");
  EXPECT_EQ(text.find("heads"), std::string::npos);
  EXPECT_TRUE(gradcheck::same_bits(answer(bundle_of(file, "w")), usual));
}

/// A value that becomes whatever a member is initialised with.
struct Anything {
  template <class T>
  operator T() const;  // NOLINT: that is what it is for
};
/// How many members an aggregate has: as many as it can be initialised with.
template <class C, class... Known>
constexpr size_t members() {
  if constexpr (requires { C{Known{}..., Anything{}}; })
    return members<C, Known..., Anything>();
  else
    return sizeof...(Known);
}

/// `given`: members that are no keys, since the model's name or its input says them.
template <class C>
void expect_all_are_keys(const char* what, size_t given) {
  EXPECT_EQ(write_config(AnyConfig(C{})).children.size() + given, members<C>()) << what;
}

TEST(WeightsBundle, EverySizeOfAModelIsAKey) {
  expect_all_are_keys<PatchTransformerConfig>("patch transformer", 0);
  expect_all_are_keys<PointTransformerConfig>("point transformer", 0);
  expect_all_are_keys<PointNetConfig>("PointNet", 0);
  expect_all_are_keys<SmrmConfig>("SMRM", 2);  // kind of rotation, 22 joints
  expect_all_are_keys<HybridConfig>("hybrid", 0);
  expect_all_are_keys<MlpConfig>("deformation networks", 0);
  expect_all_are_keys<DiscriminatorConfig>("discriminator", 2);  // widths of its inputs
  expect_all_are_keys<NptConfig>("NPT", 0);
  expect_all_are_keys<LartConfig>("LART", 0);
  expect_all_are_keys<CoreNetConfig>("3D-CoreNet", 0);
  expect_all_are_keys<TstConfig>("TST", 0);
  expect_all_are_keys<H4dConfig>("H4D", 0);
}

TEST(WeightsBundle, EveryShapeOfAModelComesBack) {
  const std::pair<const char*, std::vector<std::string>> small[] = {
      {"skeleton/patch_transformer", {"patch=8", "width=16", "layers=1", "heads=2"}},
      {"skeleton/point_transformer", {"width=8", "base=4", "head1=6", "head2=5", "layers=1"}},
      {"skeleton/pointnet", {"widths=[3, 4, 5, 6, 7]"}},
      {"smrm/rot6d", {"hidden=4", "layers=3"}},
      {"smrm/hybrid", {"hidden=4", "layers=1"}},
      {"smrm/discriminator", {"widths=[2, 3, 4, 5]"}}};
  for (const auto& [name, sizes] : small) {
    Bundle made;
    made.put(model_type(name).role, testing::untrained_model(name, sizes, {{7, 1}, DType::f32}));
    const TensorFile file = to_file(made);
    EXPECT_EQ(safetensors_bytes(to_file(bundle_of(file, name))), safetensors_bytes(file)) << name;
  }
  EXPECT_THROW(model_config("skeleton/pointnet", {"widths=[3, 4, 5, 6]"}), InputError);
  EXPECT_THROW(model_config("skeleton/pointnet", {"widths=[3, 4, 5, 6, 0]"}), InputError);
  EXPECT_THROW(model_config("skeleton/patch_transformer", {"heads=0"}), InputError);
  EXPECT_THROW(model_config("skeleton/patch_transformer", {"heads=3"}), InputError);
  EXPECT_THROW(model_config("skeleton/patch_transformer", {"points=63"}), InputError)
      << "fewer points than centres";
}

TEST(WeightsBundle, SizesAreSetByName) {
  const auto config = [](const std::vector<std::string>& sizes) {
    return model_config("smrm/rot6d", sizes).as<SmrmConfig>();
  };
  const SmrmConfig s = config({"hidden=256", "standardise=true", "dropout=0.1"});
  EXPECT_EQ(s.hidden, 256);
  EXPECT_TRUE(s.standardise);
  EXPECT_EQ(s.dropout, 0.1);
  EXPECT_THROW(config({"hiden=256"}), InputError);
  EXPECT_THROW(config({"hidden=many"}), InputError);
  EXPECT_THROW(config({"hidden=true"}), InputError);
  EXPECT_THROW(config({"centres=8"}), InputError);  // of another model
}

}  // namespace
}  // namespace restage
