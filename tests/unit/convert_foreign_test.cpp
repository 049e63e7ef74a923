// SPDX-License-Identifier: Apache-2.0
//
// `ravencal convert` of models from elsewhere, as a user runs it: what it says, what it refuses.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "core/whole_file.hpp"
#include "exchange/hdf5_handle.hpp"
#include "model/blob_writer.hpp"
#include "record/recording_writer.hpp"
#include "unit/run_command.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;
using exchange::Hdf5Handle;
using nlohmann::json;

const fs::path kModels = fs::path(RAVENCAL_SOURCE_DIR) / "tests/golden/models";

class ConvertForeign : public ::testing::Test {
 protected:
  ConvertForeign() {
    fs::remove_all(folder_);
    fs::copy(kModels, folder_);
  }
  ~ConvertForeign() override { fs::remove_all(folder_); }

  [[nodiscard]] Outcome convert(const std::string& arguments) const {
    fs::remove(folder_ / "w.blob");
    return run_command(fmt::format("cd '{}' && '{}' convert {} --out w.blob 2>&1", folder_.string(),
                                   RAVENCAL_PROGRAM, arguments));
  }
  [[nodiscard]] bool written() const {
    const auto files = fs::directory_iterator(folder_);
    return std::any_of(begin(files), end(files), [](const fs::directory_entry& file) {
      return file.path().filename().string().starts_with("w.blob");
    });
  }
  void expect_refusal(const std::string& arguments, int exit_code, const std::string& says) const {
    const Outcome outcome = convert(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments << "\n" << outcome.text;
    EXPECT_NE(outcome.text.find(says), std::string::npos) << arguments << "\n" << outcome.text;
    EXPECT_FALSE(written()) << arguments;
  }

  /// scaling.json with these keys set, or taken out where null, as NAME.
  void write_scaling(const std::string& name, const json& changes) const {
    std::ifstream stream(kModels / "scaling.json");
    json scaling = json::parse(stream);
    for (const auto& [key, value] : changes.items()) {
      scaling[key] = value;
      if (value.is_null()) scaling.erase(key);
    }
    ASSERT_TRUE(core::write_whole_file(folder_ / name, scaling.dump()).ok());
  }

  /// Replaces a text in the configuration of the GRU model.
  void reconfigure(const std::string& from, const std::string& to) const {
    fs::copy_file(kModels / "keras3_gru.h5", folder_ / "changed.h5",
                  fs::copy_options::overwrite_existing);
    const Hdf5Handle file(H5Fopen((folder_ / "changed.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT),
                          H5Fclose);
    std::string config;
    {
      const Hdf5Handle attribute(H5Aopen(file.get(), "model_config", H5P_DEFAULT), H5Aclose);
      const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
      char* text = nullptr;
      ASSERT_GE(H5Aread(attribute.get(), type.get(), static_cast<void*>(&text)), 0);
      config = text;
      (void)H5free_memory(text);
    }
    const std::size_t at = config.find(from);
    ASSERT_NE(at, std::string::npos) << from << " is not in " << config;
    config.replace(at, from.size(), to);
    ASSERT_GE(H5Adelete(file.get(), "model_config"), 0);
    const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    (void)H5Tset_size(type.get(), config.size());
    const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    const Hdf5Handle attribute(
        H5Acreate2(file.get(), "model_config", type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
        H5Aclose);
    ASSERT_GE(H5Awrite(attribute.get(), type.get(), config.data()), 0);
  }

  fs::path folder_ =
      fs::temp_directory_path() / fmt::format("ravencal_convert_foreign_test_{}", ::getpid());
};

/// 3000 rows of smooth motion with the four inputs. The truth lies `error` (rad, m) off the
/// estimate, by default so far that no sample model, whose answers are nonsense, is worse than raw.
record::Recording motion(double error = 10.0) {
  constexpr int kRows = 3000;
  record::Recording recording;
  recording.channels = {{"truth.shoulder", "rad", record::Role::kJointTruth, "shoulder"},
                        {"jpos.shoulder", "rad", record::Role::kJointEstimate, "shoulder"},
                        {"truth.insertion", "m", record::Role::kJointTruth, "insertion"},
                        {"jpos.insertion", "m", record::Role::kJointEstimate, "insertion"},
                        {"jpos.elbow", "rad", record::Role::kFeature, "elbow"},
                        {"tau.elbow", "N_m", record::Role::kFeature, "elbow"},
                        {"mpos.elbow", "rad", record::Role::kFeature, "elbow"}};
  recording.samples.resize(kRows, static_cast<Eigen::Index>(recording.channels.size()));
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 1e-3);
  for (int row = 0; row < kRows; ++row) {
    recording.t_ns.push_back(row * std::int64_t{10'000'000});
    for (Eigen::Index c = 0; c < recording.samples.cols(); ++c) {
      const double phase = 0.01 * row * (1.0 + 0.3 * static_cast<double>(c));
      recording.samples(row, c) = 0.2 * std::sin(phase) + noise(random);
    }
    // On the side to which the sample models' answers lie.
    recording.samples(row, 0) = recording.samples(row, 1) - error;
    recording.samples(row, 2) = recording.samples(row, 3) + error;
  }
  return recording;
}

TEST_F(ConvertForeign, WritesEachKindAndPrintsHowCloseItIs) {
  write_scaling("graph.json", {{"input_mean", nullptr},
                               {"input_scale", nullptr},
                               {"output_mean", nullptr},
                               {"output_scale", nullptr}});
  const std::pair<const char*, const char*> models[] = {
      {"torch_plain.onnx", "scaling.json"},  {"torch_scaled.onnx", "graph.json"},
      {"torch_unfolded.onnx", "graph.json"}, {"tensorflow.onnx", "graph.json"},
      {"keras2_dense.h5", "scaling.npz"},    {"keras3_gru.h5", "scaling_compressed.npz"}};
  for (const auto& [model, scaling] : models) {
    const Outcome outcome =
        convert(fmt::format("{} --scaling {} --unbounded-loop", model, scaling));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
    EXPECT_NE(outcome.text.find("random inputs"), std::string::npos) << outcome.text;
    EXPECT_NE(outcome.text.find("largest difference"), std::string::npos) << outcome.text;
    const auto blob = model::read_blob(folder_ / "w.blob");
    ASSERT_TRUE(blob.ok()) << blob.error().message;
    EXPECT_NE(blob->provenance.at("source").find(model), std::string::npos);
    const auto words = model::describe_blob(folder_ / "w.blob");
    ASSERT_TRUE(words.ok());
    EXPECT_EQ(words->find("4 -> 20 gru (over 8 samples, 1 rows apart) -> 12 sigmoid") !=
                  std::string::npos,
              std::string_view(model) == "keras3_gru.h5")
        << *words;
  }
}

TEST_F(ConvertForeign, GivesItsDifferencesToPrograms) {
  const Outcome outcome = convert("keras3_gru.h5 --scaling scaling.json --unbounded-loop --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
  const json result = json::parse(outcome.text);
  EXPECT_EQ(result["source"]["window"], 8);
  EXPECT_EQ(result["source"]["joints"].size(), 2U);
  EXPECT_LT(result["source"]["joints"][0]["largest_difference"].get<double>(), 1e-6);
  EXPECT_FALSE(result["source"]["trust_region"].get<bool>());
}

TEST_F(ConvertForeign, TakesRangeAndTrustFromTheRecordingsOfTheTraining) {
  ASSERT_TRUE(record::write_recording(motion(), folder_ / "train.db").ok());
  write_scaling("open.json", {{"input_min", nullptr}, {"input_max", nullptr}});
  for (const char* model : {"torch_plain.onnx", "keras3_gru.h5"}) {
    expect_refusal(fmt::format("{} --scaling open.json", model), 3, "--calibrate");
    const Outcome outcome = convert(fmt::format(
        "{} --scaling open.json --calibrate train.db --check train.db --max-rmse-change 0.01",
        model));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
    const auto blob = model::read_blob(folder_ / "w.blob");
    ASSERT_TRUE(blob.ok()) << blob.error().message;
    EXPECT_TRUE(blob->trust.has_value());
    EXPECT_NEAR(blob->input_max[0], 0.2, 0.01);
  }
}

TEST_F(ConvertForeign, ChecksAGruOnWholeWindowsOnly) {
  ASSERT_TRUE(record::write_recording(motion(), folder_ / "train.db").ok());
  write_scaling("strided.json", {{"stride_rows", 5}});
  const Outcome outcome = convert(
      "keras3_gru.h5 --scaling strided.json --check train.db --precision int8 --calibrate train.db "
      "--json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
  const json result = json::parse(outcome.text);
  EXPECT_EQ(result["check"]["rows_lost"], 35);  // seven steps of five rows
  EXPECT_EQ(result["check"]["rows"], 2965);
}

TEST_F(ConvertForeign, NamesWhatTheScalingFileLacks) {
  expect_refusal("torch_plain.onnx", 2, "--scaling");
  expect_refusal("torch_plain.onnx --scaling none.json", 3, "none.json");
  expect_refusal("torch_scaled.onnx --scaling scaling.json", 3, "scaled twice");
  write_scaling("a.json", {{"output_mean", nullptr}, {"output_scale", nullptr}});
  expect_refusal("torch_plain.onnx --scaling a.json", 3, "nothing scales the outputs");
  write_scaling("b.json", {{"features", {"jpos.shoulder", "jpos.elbow", "tau.elbow"}},
                           {"input_mean", 0},
                           {"input_scale", 1},
                           {"input_min", -1},
                           {"input_max", 1}});
  expect_refusal("keras2_dense.h5 --scaling b.json", 3,
                 "4 inputs and 2 outputs, the scaling file names 3 and 2");
  write_scaling("c.json", {{"window", 5}});
  expect_refusal("keras3_gru.h5 --scaling c.json", 3, "looks at 8 samples");
  expect_refusal("keras2_dense.h5 --scaling c.json", 3, "no GRU");
}

TEST_F(ConvertForeign, NamesTheLayerThatItCannotTake) {
  const std::pair<const char*, std::pair<const char*, const char*>> changes[] = {
      {"reset_after=True", {"\"reset_after\": true", "\"reset_after\": false"}},
      {"recurrent_activation",
       {"\"recurrent_activation\": \"sigmoid\"", "\"recurrent_activation\": \"hard_sigmoid\""}},
      {"layer 1 'gru' (LSTM)", {"\"class_name\": \"GRU\"", "\"class_name\": \"LSTM\""}},
      {"activation 'gelu'", {"\"activation\": \"sigmoid\"", "\"activation\": \"gelu\""}},
      {"return_sequences", {"\"return_sequences\": false", "\"return_sequences\": true"}},
      {"stateful", {"\"stateful\": false", "\"stateful\": true"}},
      {"one chain", {"\"keras_history\": [\"dense\", 0, 0]", "\"keras_history\": [\"gru\", 0, 0]"}},
      {"of kind 'Subclass'", {"\"Functional\"", "\"Subclass\""}},
      {"kernel is 4 x 60", {"\"units\": 20", "\"units\": 21"}}};
  for (const auto& [says, change] : changes) {
    reconfigure(change.first, change.second);
    ASSERT_FALSE(HasFatalFailure());
    expect_refusal("changed.h5 --scaling scaling.json", 3, says);
  }
}

TEST_F(ConvertForeign, RefusesFilesThatAreNoModels) {
  for (const char* name : {"text.h5", "text.onnx"}) {
    ASSERT_TRUE(core::write_whole_file(folder_ / name, "no model").ok());
    expect_refusal(fmt::format("{} --scaling scaling.json", name), 3, name);
    fs::remove(folder_ / name);
    expect_refusal(fmt::format("{} --scaling scaling.json", name), 3, name);
  }
  expect_refusal("m.keras --scaling scaling.json", 2, "model.save(\"model.h5\")");
  {
    const Hdf5Handle empty(
        H5Fcreate((folder_ / "weights.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT),
        H5Fclose);
    ASSERT_TRUE(empty.ok());
  }
  expect_refusal("weights.h5 --scaling scaling.json", 3, "weights only");
}

TEST_F(ConvertForeign, RefusesAModelThatIsWorseThanNoCorrection) {
  ASSERT_TRUE(record::write_recording(motion(1e-3), folder_ / "test.db").ok());
  const std::string command = "torch_plain.onnx --scaling scaling.json --unbounded-loop";
  expect_refusal(command + " --check test.db", 1, "worse than raw, RMSE");
  expect_refusal(command + " --check test.db", 1, "against 0.0573 deg");
  expect_refusal(command + " --check test.db", 1, "truth - estimate) in scaling.json");
  const Outcome program = convert(command + " --check test.db --json");
  EXPECT_EQ(program.exit_code, 1);
  const json joint = json::parse(program.text)["check"]["joints"][0];
  EXPECT_TRUE(joint["worse_than_raw"].get<bool>());
  EXPECT_NEAR(joint["raw_rmse"].get<double>(), 1e-3, 1e-9);
  EXPECT_EQ(convert(command).exit_code, 0);
  EXPECT_EQ(convert(command + " --calibrate test.db").exit_code, 0);
}

TEST_F(ConvertForeign, WillNotCompactAGru) {
  expect_refusal("keras3_gru.h5 --scaling scaling.json --compact", 2, "GRU");
}

}  // namespace
}  // namespace ravencal::test
