// SPDX-License-Identifier: Apache-2.0
//
// Keras layers that are folded or passed on, against the formulas of the layers.
#include <fmt/format.h>
#include <hdf5.h>
#include <unistd.h>

#include "exchange/hdf5_handle.hpp"
#include "unit/conversion_fold.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;
using exchange::Hdf5Handle;
using nlohmann::json;

/// A Sequential model put together layer by layer and written as Keras 3 writes it.
class Keras {
 public:
  Keras() {
    file_.emplace(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    weights_.emplace(
        H5Gcreate2(file_->get(), "model_weights", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  }
  ~Keras() { fs::remove(path_); }
  Keras(const Keras&) = delete;
  Keras& operator=(const Keras&) = delete;

  struct Weights {
    std::string name;
    std::vector<hsize_t> dims;
    Values values;
  };
  void layer(const std::string& class_name, json config, const std::vector<Weights>& all = {}) {
    const std::string name = fmt::format("layer_{}", layers_.size());
    config["name"] = name;
    layers_.push_back({{"class_name", class_name}, {"config", config}});
    const Hdf5Handle group(
        H5Gcreate2(weights_->get(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    std::vector<std::string> names;
    for (const Weights& one : all) {
      const Hdf5Handle space(
          H5Screate_simple(static_cast<int>(one.dims.size()), one.dims.data(), nullptr), H5Sclose);
      const Hdf5Handle set(H5Dcreate2(group.get(), one.name.c_str(), H5T_NATIVE_DOUBLE, space.get(),
                                      H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                           H5Dclose);
      EXPECT_GE(
          H5Dwrite(set.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, one.values.data()),
          0);
      names.push_back(one.name);
    }
    if (!names.empty()) texts(group.get(), "weight_names", names);
  }
  void input(const json& shape) { layer("InputLayer", {{"batch_shape", shape}}); }
  void dense(const std::string& activation = "linear") {
    layer("Dense", {{"units", 2}, {"activation", activation}, {"use_bias", true}},
          {{"kernel", {2, 2}, {2.0, 0.5, -1.0, 3.0}}, {"bias", {2}, {0.25, -1.0}}});
  }
  void normalise() {
    layer("BatchNormalization", {{"axis", {-1}}, {"epsilon", 0.25}},
          {{"gamma", {2}, {1.5, -2.0}},
           {"beta", {2}, {0.5, 4.0}},
           {"moving_mean", {2}, {3.0, -1.0}},
           {"moving_variance", {2}, {3.75, 0.0}}});
  }
  core::Result<conversion::ForeignModel> read() {
    const json config = {{"class_name", "Sequential"}, {"config", {{"layers", layers_}}}};
    texts(file_->get(), "model_config", {config.dump()});
    weights_.reset();
    file_.reset();
    return conversion::read_keras(path_.string());
  }
  std::string refusal() {
    const auto model = read();
    return model.ok() ? "accepted" : model.error().message;
  }

 private:
  static void texts(hid_t object, const char* name, const std::vector<std::string>& values) {
    const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    (void)H5Tset_size(type.get(), H5T_VARIABLE);
    const hsize_t count = values.size();
    const Hdf5Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose);
    const Hdf5Handle attribute(
        H5Acreate2(object, name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    std::vector<const char*> pointers;
    for (const std::string& value : values) pointers.push_back(value.c_str());
    EXPECT_GE(H5Awrite(attribute.get(), type.get(), pointers.data()), 0);
  }

  fs::path path_ = fs::temp_directory_path() / fmt::format("fold_{}.h5", ::getpid());
  std::optional<Hdf5Handle> file_;
  std::optional<Hdf5Handle> weights_;
  json layers_ = json::array();
};

/// Mean 2 and -4, deviation 0.5 and 3.
Values standardised(const Values& x) { return {(x[0] - 2.0) / 0.5, (x[1] + 4.0) / 3.0}; }

const std::vector<Keras::Weights> kMoments = {
    {"mean", {2}, {2.0, -4.0}}, {"variance", {2}, {0.25, 9.0}}, {"count", {}, {900.0}}};

TEST(KerasFolding, TakesNormalisationsInEveryPlace) {
  Keras first;
  first.input({nullptr, 2});
  first.layer("Normalization", {{"axis", {-1}}, {"invert", false}}, kMoments);
  first.normalise();
  first.dense();
  expect_answers(first.read(), [](const Values& x) { return dense(normalised(standardised(x))); });
  Keras behind;
  behind.dense("relu");
  behind.normalise();
  behind.layer("Dropout", {{"rate", 0.5}});
  behind.dense();
  behind.layer("Rescaling", {{"scale", 0.5}, {"offset", {1.0, -3.0}}});
  expect_answers(behind.read(), [](const Values& x) {
    const Values y = dense(normalised(leak(dense(x), 0.0, 0.0)));
    return Values{0.5 * y[0] + 1.0, 0.5 * y[1] - 3.0};
  });
  Keras inverted;
  inverted.layer("Rescaling", {{"scale", -0.25}, {"offset", 1.0}, {"batch_shape", {nullptr, 2}}});
  inverted.dense();
  inverted.layer("Normalization",
                 {{"invert", true}, {"mean", {2.0, -4.0}}, {"variance", {0.25, 9.0}}});
  expect_answers(inverted.read(), [](const Values& x) {
    const Values y = dense({1.0 - 0.25 * x[0], 1.0 - 0.25 * x[1]});
    return Values{0.5 * y[0] + 2.0, 3.0 * y[1] - 4.0};
  });
}

TEST(KerasFolding, RunsLeaksAndPassesFlatVectorsOn) {
  Keras model;
  model.input({nullptr, 2});
  model.layer("Flatten", json::object());
  model.dense("leaky_relu");
  model.layer("Reshape", {{"target_shape", {2}}});
  model.dense();
  model.layer("LeakyReLU", {{"negative_slope", 0.375}});
  model.dense();
  model.layer("PReLU", json::object(), {{"alpha", {2}, {0.75, -0.125}}});
  model.dense();
  model.layer("ReLU", {{"max_value", nullptr}, {"negative_slope", 0.0}, {"threshold", 0.0}});
  model.dense();
  expect_answers(model.read(), [](const Values& x) {
    const Values a = dense(leak(dense(x), 0.2, 0.2));
    const Values b = dense(leak(a, 0.375, 0.375));
    return dense(leak(dense(leak(b, 0.75, -0.125)), 0.0, 0.0));
  });
}

TEST(KerasFolding, NamesTheLayerThatItCannotFold) {
  const auto refused = [](const std::function<void(Keras&)>& add, const std::string& says) {
    Keras model;
    model.dense();
    add(model);
    model.dense();
    const std::string text = model.refusal();
    EXPECT_NE(text.find(says), std::string::npos) << text;
    EXPECT_NE(text.find("layer 1 'layer_1'"), std::string::npos) << text;
  };
  refused([](Keras& model) { model.layer("ReLU", {{"max_value", 6.0}}); }, "max_value is 6");
  refused([](Keras& model) { model.layer("ReLU", {{"threshold", 0.5}}); }, "threshold is 0.5");
  refused([](Keras& model) { model.layer("Reshape", {{"target_shape", {1, 2}}}); }, "(2,)");
  refused(
      [](Keras& model) {
        model.layer("Normalization", {{"axis", {-1}}});
      },
      "its mean is not in the file");
  refused(
      [](Keras& model) {
        model.layer("Conv1D", json::object(), {{"kernel", {1, 2, 2}, {1.0, 2.0, 3.0, 4.0}}});
      },
      "(Conv1D): not supported");
  refused(
      [](Keras& model) {
        model.layer("Dense", {{"units", 2}}, {{"kernel", {1, 2, 2}, {1.0, 2.0, 3.0, 4.0}}});
      },
      "weights 'kernel' have 3 dimensions");
}

}  // namespace
}  // namespace ravencal::test
