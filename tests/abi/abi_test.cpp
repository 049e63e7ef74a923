// SPDX-License-Identifier: Apache-2.0
//
// The shared object and its C ABI, as a host meets them.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "physics/raven_kinematics.hpp"
#include "rt/rig.hpp"

extern "C" int ravencal_header_in_c(void);
int header_in_cxx98();
int header_in_cxx20();

namespace ravencal::test {
namespace {

TEST(Header, CompilesAsC90AndAsOldAndNewCxx) {
  EXPECT_EQ(ravencal_header_in_c(), static_cast<int>(sizeof(ravencal_output)));
  EXPECT_EQ(header_in_cxx98(), static_cast<int>(sizeof(ravencal_state)));
  EXPECT_EQ(header_in_cxx20(), static_cast<int>(sizeof(ravencal_state)));
}

#if !defined(RAVENCAL_SANITIZED)  // sanitizers bring symbols and libraries of their own
/// Lines that a command prints.
std::vector<std::string> lines_of(const std::string& command) {
  std::vector<std::string> lines;
  FILE* const pipe = ::popen(command.c_str(), "r");
  EXPECT_NE(pipe, nullptr);
  std::array<char, 4096> line{};
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) {
    lines.emplace_back(line.data());
    lines.back().erase(lines.back().find_last_not_of('\n') + 1);
  }
  EXPECT_EQ(::pclose(pipe), 0) << command;
  return lines;
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream stream(line);
  return {std::istream_iterator<std::string>(stream), {}};
}

std::set<std::string> exported_by(const std::string& library) {
  std::set<std::string> symbols;
  for (const std::string& line : lines_of("nm -D --defined-only " + library)) {
    const auto words = words_of(line);  // address, type, name; A: the version's own node
    if (words[1] != "A") symbols.insert(words[2].substr(0, words[2].find('@')));
  }
  return symbols;
}

/// Libraries that it needs besides the C library.
std::set<std::string> foreign_needs_of(const std::string& library) {
  std::set<std::string> needs;
  for (const std::string& line : lines_of("readelf -dW " + library)) {
    if (line.find("(NEEDED)") == std::string::npos) continue;
    const auto at = line.find('[');
    needs.insert(line.substr(at + 1, line.find(']') - at - 1));
  }
  needs.erase("libc.so.6");
  needs.erase("libm.so.6");
  return needs;
}

/// Minor version of the newest glibc symbol that it asks for.
int newest_glibc_of(const std::string& library) {
  int newest = 0;
  for (const std::string& line : lines_of("objdump -T " + library)) {
    const auto at = line.find("GLIBC_2.");
    if (at == std::string::npos) continue;
    newest = std::max(newest, std::atoi(line.c_str() + at + std::strlen("GLIBC_2.")));
  }
  return newest;
}

/// What exceptions and run-time types leave in an object: unwind tables for catching, calls of the
/// C++ runtime, type descriptions.
std::set<std::string> cxx_runtime_in(const std::string& library) {
  std::set<std::string> found;
  for (const std::string& line : lines_of("readelf -SW " + library)) {
    if (line.find(".gcc_except_table") != std::string::npos) found.insert(".gcc_except_table");
  }
  for (const std::string& line : lines_of("nm -D " + library + "; nm " + library + " 2>&1")) {
    for (const char* name :
         {"__cxa_throw", "__gxx_personality_v0", "_ZTI", "_ZTS", "__cxa_guard"}) {
      if (line.find(name) != std::string::npos) found.insert(name);
    }
  }
  return found;
}

TEST(SharedObject, ExportsOneSymbol) {
  EXPECT_EQ(exported_by(RAVENCAL_PLUGIN_PATH), std::set<std::string>{"ravencal_plugin_entry"});
}

TEST(SharedObject, NeedsOnlyTheCLibrary) {
  EXPECT_EQ(foreign_needs_of(RAVENCAL_PLUGIN_PATH), std::set<std::string>{});
}

TEST(SharedObject, RunsWithGlibc217) { EXPECT_LE(newest_glibc_of(RAVENCAL_PLUGIN_PATH), 17); }

TEST(SharedObject, HasNoExceptionsAndNoRunTimeTypes) {
  EXPECT_EQ(cxx_runtime_in(RAVENCAL_PLUGIN_PATH), std::set<std::string>{});
}

TEST(SharedObject, WouldBeFoundOutIfItBrokeTheseRules) {
  const std::string library = RAVENCAL_RULE_BREAKER;
  EXPECT_GE(exported_by(library).size(), 2U);
  EXPECT_TRUE(foreign_needs_of(library).contains("libstdc++.so.6"));
  EXPECT_GT(newest_glibc_of(library), 17);
  const std::set<std::string> found = cxx_runtime_in(library);
  for (const char* name : {".gcc_except_table", "__cxa_throw", "__gxx_personality_v0", "_ZTI"}) {
    EXPECT_TRUE(found.contains(name)) << name;
  }
}

TEST(SharedObject, KernelsOfDifferentInstructionSetsShareNoFunctionAndAskForNoMemory) {
  // The linker may merge what is not local: only Eigen's may be, under the set's own name (mangled
  // behind its length). What would allocate, print or abort is another library's.
  const std::set<std::string> may_ask_for = {"memset", "memcpy", "memmove"};
  std::istringstream objects(RAVENCAL_KERNEL_OBJECTS);
  int entries = 0;
  for (std::string object; std::getline(objects, object, '|'); --entries) {
    const std::string isa = object.substr(0, object.find('='));
    const std::string eigen = std::to_string(isa.size() + 6) + "Eigen_" + isa;
    for (const std::string& line : lines_of("nm -g " + object.substr(isa.size() + 1))) {
      const auto words = words_of(line);
      const std::string& name = words.back();
      const bool is_entry = name.find("forward_" + isa + "E") != std::string::npos;
      entries += is_entry ? 1 : 0;
      EXPECT_TRUE(is_entry || name.find(eigen) != std::string::npos ||
                  (words.front() == "U" && may_ask_for.contains(name)))
          << isa << ": " << line;
    }
  }
  EXPECT_EQ(entries, 0) << "one function for each set";
}
#endif

TEST(Entry, RefusesEveryOtherMajorVersion) {
  void* const library = ::dlopen(RAVENCAL_PLUGIN_PATH, RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(library, nullptr) << ::dlerror();
  const auto entry =
      reinterpret_cast<ravencal_plugin_entry_fn>(::dlsym(library, "ravencal_plugin_entry"));
  ASSERT_NE(entry, nullptr);
  EXPECT_EQ(entry(RAVENCAL_ABI_MAJOR + 1), nullptr);
  EXPECT_EQ(entry(0), nullptr);
  const ravencal_api* const api = entry(RAVENCAL_ABI_MAJOR);
  ASSERT_NE(api, nullptr);
  EXPECT_EQ(api->struct_size, sizeof(ravencal_api));
  EXPECT_EQ(api->abi_minor, static_cast<std::uint32_t>(RAVENCAL_ABI_MINOR));
  EXPECT_STRNE(api->version(), "");
  ::dlclose(library);
}

TEST(Structs, SmallerThanThisVersionAreRefusedAndLargerOnesAccepted) {
  Rig rig;
  rig.load(make_model(16, {}));
  rig.output.jpos_ji[0] = 123.0F;
  rig.state.struct_size = sizeof(ravencal_state) - 1;
  EXPECT_EQ(rig.tick(), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_EQ(rig.output.jpos_ji[0], 123.0F) << "nothing may be written";
  rig.state.struct_size = sizeof(ravencal_state) + 64;
  rig.output.struct_size = offsetof(ravencal_output, desired_ji) - 1;
  EXPECT_EQ(rig.tick(), RAVENCAL_ERROR_ARGUMENT);
  rig.output.struct_size = sizeof(ravencal_output) + 64;
  EXPECT_EQ(rig.tick(), RAVENCAL_BYPASS);
  ravencal_counters counters{};
  EXPECT_EQ(rig.api().counters(rig.instance.get(), &counters), RAVENCAL_ERROR_ARGUMENT);
}

TEST(Structs, OfVersion30AreTakenAsTheyAre) {
  Rig rig([](ravencal_config& config) {
    config.struct_size = offsetof(ravencal_config, lowest_ji);
    config.lowest_ji[0] = 2.0F;  // not part of it: would be inverted
    config.highest_ji[0] = 1.0F;
  });
  rig.load(make_model(16, {}));
  rig.enable();
  rig.output.struct_size = offsetof(ravencal_output, desired_ji);
  rig.output.desired_ji[0] = 123.0F;
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  EXPECT_EQ(rig.output.desired_ji[0], 123.0F) << "nothing may be written beyond";
  ravencal_config defaults{};
  defaults.struct_size = offsetof(ravencal_config, lowest_ji);
  defaults.lowest_ji[0] = 123.0F;
  EXPECT_EQ(rig.api().default_config(&defaults), RAVENCAL_SUCCESS);
  EXPECT_EQ(defaults.lowest_ji[0], 123.0F);
  EXPECT_EQ(defaults.struct_size, offsetof(ravencal_config, lowest_ji));
}

TEST(Structs, NullPointersAreRefused) {
  Rig rig;
  ravencal_api const& api = rig.api();
  EXPECT_EQ(api.step(nullptr, &rig.state, &rig.output), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_EQ(api.step(rig.instance.get(), nullptr, &rig.output), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_EQ(api.step(rig.instance.get(), &rig.state, nullptr), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_EQ(api.load(nullptr, "x"), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_EQ(api.load(rig.instance.get(), nullptr), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_STRNE(api.last_error(nullptr), nullptr);
  api.enable(nullptr, 1);
  api.reset(nullptr);
  api.destroy(nullptr);
  api.observe_cycle_end(nullptr, nullptr);
  api.uncorrect_desired(nullptr, nullptr, nullptr);
}

TEST(Create, RefusesSettingsThatMakeNoSense) {
  Rig rig;
  struct alignas(64) Storage {
    std::array<std::byte, 65536> bytes;
  };
  const auto memory = std::make_unique<Storage>();
  std::array<std::byte, 65536>& storage = memory->bytes;
  ASSERT_LE(rig.api().storage_size(), storage.size());
  ravencal_instance* instance = nullptr;
  const auto create = [&](const ravencal_config& config, std::size_t shift = 0,
                          std::size_t bytes = 65536 - 64) {
    return rig.api().create(&config, storage.data() + shift, bytes, &instance);
  };
  const ravencal_config good = rig.config;
  ravencal_config bad = good;
  bad.tick_ns = 0;
  EXPECT_EQ(create(bad), RAVENCAL_ERROR_ARGUMENT);
  bad = good;
  bad.slew_ji_per_s[1] = -1.0F;
  EXPECT_EQ(create(bad), RAVENCAL_ERROR_ARGUMENT);
  bad = good;
  bad.max_correction_ji[2] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(create(bad), RAVENCAL_ERROR_ARGUMENT);
  bad = good;
  bad.max_isa = 9;
  EXPECT_EQ(create(bad), RAVENCAL_ERROR_ARGUMENT);
  bad = good;
  bad.struct_size = 4;
  EXPECT_EQ(create(bad), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_EQ(create(good, 0, rig.api().storage_size() - 1), RAVENCAL_ERROR_MEMORY);
  EXPECT_EQ(create(good, 4), RAVENCAL_ERROR_MEMORY);
  ASSERT_EQ(create(good), RAVENCAL_SUCCESS);
  rig.api().destroy(instance);
}

TEST(Load, NamesWhatIsWrongAndKeepsWhatRuns) {
  Rig rig;
  rig.load(make_model(16, {}));
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  const auto refusal = [&](const std::filesystem::path& path, std::int32_t code) {
    EXPECT_EQ(rig.api().load(rig.instance.get(), path.c_str()), code);
    return std::string(rig.api().last_error(rig.instance.get()));
  };
  EXPECT_NE(refusal("/nonexistent.blob", RAVENCAL_ERROR_IO).find("/nonexistent.blob"),
            std::string::npos);
  EXPECT_NE(refusal(scratch_folder(), RAVENCAL_ERROR_IO), "");

  const auto damaged = write_weights(make_model(16, {}), "damaged");
  std::fstream file(damaged, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(1000);
  file.put('\x7F');
  file.close();
  EXPECT_NE(refusal(damaged, RAVENCAL_ERROR_BLOB).find("checksum"), std::string::npos);
  std::ofstream(scratch_folder() / "empty").close();
  EXPECT_NE(refusal(scratch_folder() / "empty", RAVENCAL_ERROR_BLOB).find("shorter"),
            std::string::npos);

  model::CalibrationModel many = make_model(2, {});
  many.layers[0].weights = Eigen::MatrixXf::Zero(4, 2);
  many.layers[0].biases = Eigen::VectorXf::Zero(4);
  many.output.mean = Eigen::VectorXd::Zero(4);
  many.output.scale = Eigen::VectorXd::Ones(4);
  many.outputs.push_back({"wrist", "jpos.wrist", "rad"});
  EXPECT_NE(refusal(write_weights(many, "many"), RAVENCAL_ERROR_TOPOLOGY).find("corrects 4 joints"),
            std::string::npos);
  model::CalibrationModel foreign = make_model(2, {});
  foreign.features[0].channel = "yaw.motor_position";
  EXPECT_NE(refusal(write_weights(foreign, "foreign"), RAVENCAL_ERROR_FEATURES)
                .find("'yaw.motor_position'"),
            std::string::npos);
  model::CalibrationModel tool = make_model(2, {});
  tool.outputs[0].joint = "wrist";
  EXPECT_NE(refusal(write_weights(tool, "tool"), RAVENCAL_ERROR_FEATURES).find("'wrist'"),
            std::string::npos);

  EXPECT_EQ(rig.tick(), RAVENCAL_OK) << "a refused load must not touch the weights that run";
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_ACTIVE);
}

TEST(Load, TakesWeightsOfTheConfiguredArmOnly) {
  Rig gold([](ravencal_config& config) { config.arm = RAVENCAL_ARM_GOLD; });
  const auto refusal = [&](const model::CalibrationModel& model) {
    const auto path = write_weights(model, "origin");
    EXPECT_EQ(gold.api().load(gold.instance.get(), path.c_str()), RAVENCAL_ERROR_ORIGIN);
    return std::string(gold.api().last_error(gold.instance.get()));
  };
  model::CalibrationModel model = make_model(16, {});
  EXPECT_NE(refusal(model).find("convert it again with --arm gold"), std::string::npos);
  model.origin.arm = model::Arm::kGreen;
  EXPECT_NE(refusal(model).find("trained for the green arm and would correct the gold one"),
            std::string::npos);
  model.origin.arm = model::Arm::kGold;
  model.origin.coordinates = model::Coordinates::kCorrected;
  EXPECT_NE(refusal(model).find("already corrected"), std::string::npos);
  gold.enable();
  EXPECT_FALSE(gold.tick_until(RAVENCAL_STATE_FADING_IN, 1000)) << "nothing was loaded";

  model.origin.coordinates = model::Coordinates::kMotor;
  model.origin.robot = "raven_lab_7";
  model.origin.controller = "crtk";
  gold.load(model);
  EXPECT_TRUE(gold.tick_until(RAVENCAL_STATE_ACTIVE));
  const ravencal_info info = gold.instance.info();
  EXPECT_EQ(info.arm, RAVENCAL_ARM_GOLD);
  EXPECT_EQ(info.coordinates, RAVENCAL_COORDINATES_MOTOR);
  EXPECT_STREQ(info.robot, "raven_lab_7");
  EXPECT_STREQ(info.controller, "crtk");
  EXPECT_EQ(info.constant_ji[1], static_cast<float>(model.output.mean[1]));
}

TEST(UncorrectPose, IsForwardKinematicsOfTheUncorrectedJoints) {
  const float corrected_ji[RAVENCAL_JOINTS] = {0.62F, 1.41F, 0.402F};
  const float uncorrected_ji[RAVENCAL_JOINTS] = {0.58F, 1.55F, 0.391F};
  for (const std::uint32_t arm : {RAVENCAL_ARM_GOLD, RAVENCAL_ARM_GREEN}) {
    Rig rig([&](ravencal_config& config) { config.arm = arm; });
    const auto pose_at = [&](const float* joints_ji) {
      const physics::SlotVector joints = {joints_ji[0], joints_ji[1], joints_ji[2], 0.0,
                                          0.3,          -0.4,         0.7,          0.9};
      return physics::forward_kinematics(
          arm == RAVENCAL_ARM_GOLD ? physics::Arm::kGold : physics::Arm::kGreen, joints);
    };
    const physics::ToolPose from = pose_at(corrected_ji);
    const physics::ToolPose to = pose_at(uncorrected_ji);
    std::int32_t position_um[3];
    float rotation[9];
    std::copy_n(from.position_um.begin(), 3, position_um);
    std::copy_n(from.rotation.begin(), 9, rotation);
    rig.api().uncorrect_pose(rig.instance.get(), corrected_ji, uncorrected_ji, position_um,
                             rotation);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(position_um[k], to.position_um[k], 2) << k;
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(rotation[k], to.rotation[k], 1e-6) << k;
  }
}

TEST(Load, TakesNetworksOfEverySize) {
  Rig rig;
  rig.load(make_model(16, {1000, 1000}));
  rig.load(make_model(5, {9, 17, 33, 3, 65, 8, 20}));
}

TEST(Load, RunsWhatItReadWhateverHappensToTheFile) {
  Rig rig;
  const auto path = write_weights(make_model(16, {50}), "overwritten");
  ASSERT_TRUE(rig.instance.load(path).ok());
  rig.tick();
  const float before = rig.output.predicted_ji[0];
  std::ofstream(path, std::ios::trunc).close();
  rig.tick();
  EXPECT_EQ(rig.output.predicted_ji[0], before);
}

TEST(Info, TellsWhatRuns) {
  Rig rig;
  ravencal_info info{};
  info.struct_size = sizeof info;
  EXPECT_EQ(rig.api().info(rig.instance.get(), &info), RAVENCAL_ERROR_ARGUMENT) << "nothing loaded";
  rig.load(make_model({plain("jpos.elbow"), lagged("jpos.elbow", 7)}, {128, 64, 32}));
  ASSERT_EQ(rig.api().info(rig.instance.get(), &info), RAVENCAL_SUCCESS);
  EXPECT_EQ(info.inputs, 2U);
  EXPECT_EQ(info.parameters, 2U * 128 + 128 + 128 * 64 + 64 + 64 * 32 + 32 + 32 * 3 + 3);
  EXPECT_EQ(info.longest_lag_ticks, 70U);
  EXPECT_EQ(info.needs_cycle_end, 0U);
  EXPECT_GE(info.isa, RAVENCAL_ISA_BASELINE);
  EXPECT_EQ(info.precision, RAVENCAL_PRECISION_F32);
  const std::uint64_t f32_bytes = info.bytes_per_step;
  EXPECT_GT(f32_bytes, info.parameters * sizeof(float));

  rig.load(make_model({plain("jpos.elbow"), lagged("jpos.elbow", 7)}, {128, 64, 32}),
           model::packed::Precision::kInt8);
  ASSERT_EQ(rig.api().info(rig.instance.get(), &info), RAVENCAL_SUCCESS);
  EXPECT_EQ(info.precision, RAVENCAL_PRECISION_INT8);
  EXPECT_LT(info.bytes_per_step, f32_bytes / 2);

  info.struct_size -= 1;
  EXPECT_EQ(rig.api().info(rig.instance.get(), &info), RAVENCAL_ERROR_ARGUMENT);
}

}  // namespace
}  // namespace ravencal::test
