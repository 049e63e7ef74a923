// SPDX-License-Identifier: Apache-2.0
//
// Bags of raven_state and ext_jpos in and out, and what is said of those that cannot be read.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "core/catalogue.hpp"
#include "core/units.hpp"
#include "core/whole_file.hpp"
#include "record/bag_file.hpp"
#include "record/bag_load.hpp"
#include "record/load.hpp"
#include "record/profile.hpp"

namespace ravencal::record {
namespace {

namespace fs = std::filesystem;
constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart = 1'700'000'000'000'000'000;
constexpr double kLost = std::numeric_limits<double>::quiet_NaN();

class Bag : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / fmt::format("ravencal_bag_{}", ::getpid());
    fs::create_directories(folder_);
    const auto writer = BagWriter::create(folder_ / "try.bag");
    if (!writer.ok()) GTEST_SKIP() << writer.error().message;
  }
  void TearDown() override { fs::remove_all(folder_); }

  static Profile profile(const std::string& name, const std::string& arm = "gold") {
    ProfileOptions options;
    options.arm = arm;
    auto loaded = load_profile(name, options);
    EXPECT_TRUE(loaded.ok());
    return std::move(loaded).value();
  }

  /// States and truth that messages can carry without rounding: whole numbers in their units.
  static Recording states(bool with_truth, Eigen::Index rows = 300) {
    Recording recording;
    recording.source = "states.db";
    const Profile channels = profile("raven2");
    for (const auto& each : channels.channels) {
      if (!with_truth && each.channel.role == Role::kJointTruth) continue;
      recording.channels.push_back(each.channel);
      recording.channels.back().unit = core::find_unit(each.channel.unit)->si_name;
    }
    std::mt19937 generator(3);
    std::uniform_int_distribution<int> number(-2000, 2000);
    recording.samples.resize(rows, static_cast<Eigen::Index>(recording.channels.size()));
    for (Eigen::Index row = 0; row < rows; ++row) {
      recording.t_ns.push_back(kStart + row * 10 * kMs + 12'345);
      for (Eigen::Index c = 0; c < recording.samples.cols(); ++c) recording.samples(row, c) = 0.0;
      for (std::size_t i = 0; i < core::kCatalogueSize; ++i) {
        const auto& entry = core::catalogue()[i];
        recording.samples(row, *recording.column(entry.name)) =
            number(generator) * core::find_unit(entry.message_unit)->to_si;
      }
      recording.samples(row, *recording.column("time")) = 0.01 * static_cast<double>(row);
      for (Eigen::Index c = 0; with_truth && c < 3; ++c)
        recording.samples(row, c) = 1e-3 * number(generator);
    }
    return recording;
  }

  core::Result<Recording> load(const std::string& name, const std::string& profile_name = "") {
    LoadOptions options;
    options.profile = profile_name;
    return load_recording(folder_ / name, options);
  }

  fs::path folder_;
};

TEST_F(Bag, ImportsWhatItExported) {
  Recording recording = states(true);
  recording.samples.block(100, 0, 50, 3).setConstant(kLost);
  const auto exported = export_bag(recording, profile("raven2-bag"), folder_ / "r.bag");
  ASSERT_TRUE(exported.ok()) << exported.error().message;
  const auto again = load("r.bag");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->t_ns, recording.t_ns);
  ASSERT_EQ(again->channels.size(), recording.channels.size());
  for (std::size_t c = 0; c < recording.channels.size(); ++c) {
    const Channel& channel = recording.channels[c];
    EXPECT_EQ(again->channels[c].role, channel.role) << channel.name;
    EXPECT_EQ(again->channels[c].unit, channel.unit) << channel.name;
    const auto column = again->column(channel.name);
    ASSERT_TRUE(column) << channel.name;
    for (Eigen::Index row = 0; row < recording.rows(); ++row) {
      const double expected = recording.samples(row, static_cast<Eigen::Index>(c));
      const double found = again->samples(row, *column);
      if (std::isnan(expected)) {
        ASSERT_TRUE(std::isnan(found)) << channel.name << " row " << row;
      } else {
        ASSERT_NEAR(found, expected, 1e-12 * (1.0 + std::abs(expected)))
            << channel.name << " row " << row;
      }
    }
  }
  EXPECT_EQ(again->meta.at("arm"), "gold");
}

TEST_F(Bag, KeepsTheArmsApart) {
  const Recording recording = states(true);
  ASSERT_TRUE(export_bag(recording, profile("raven2-bag", "green"), folder_ / "g.bag").ok());
  const auto as_gold = load("g.bag");
  ASSERT_TRUE(as_gold.ok());
  EXPECT_NEAR(as_gold->samples(5, *as_gold->column("other.jpos.elbow")),
              recording.samples(5, *recording.column("jpos.elbow")), 1e-9);
}

TEST_F(Bag, HasNoTruthChannelsWhereTheBagHasNoTruth) {
  ASSERT_TRUE(export_bag(states(false), profile("raven2-bag"), folder_ / "s.bag").ok());
  const auto recording = load("s.bag");
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  EXPECT_EQ(recording->channels.size(), core::kCatalogueSize);
  const auto truth = load("s.bag", "raven2-bag-truth");
  ASSERT_FALSE(truth.ok());
  EXPECT_NE(truth.error().message.find("ext_jpos"), std::string::npos) << truth.error().message;
}

TEST_F(Bag, InterpolatesATruthOfItsOwnRateAndGivesItAlone) {
  auto bag = BagWriter::create(folder_ / "i.bag");
  ASSERT_TRUE(bag.ok());
  RavenStateMessage state;
  for (int i = 0; i < 100; ++i) {
    const std::int64_t t = kStart + i * 10 * kMs;
    state.stamp_ns = t + 4 * kMs;
    ASSERT_TRUE(
        bag->write("/ravenstate", raven_state_type(), t, encode_raven_state(state, true)).ok());
    if (i >= 40 && i < 60) continue;
    const double x = 0.01 * i;
    ASSERT_TRUE(
        bag->write("/ext_jpos", joint_state_type(), t, encode_joint_state({t, {}, {x, -x, x}, {}}))
            .ok());
  }
  ASSERT_TRUE(bag->close().ok());
  const auto states = load("i.bag");
  ASSERT_TRUE(states.ok()) << states.error().message;
  EXPECT_NEAR(states->samples(10, 0), 0.104, 1e-12);
  EXPECT_NEAR(states->samples(10, 1), -0.104, 1e-12);
  EXPECT_TRUE(std::isnan(states->samples(50, 0))) << "no truth is invented across a gap";
  const auto truth = load("i.bag", "raven2-bag-truth");
  ASSERT_TRUE(truth.ok()) << truth.error().message;
  EXPECT_EQ(truth->rows(), 80);
  EXPECT_EQ(truth->channels[2].name, "truth.insertion");
  EXPECT_EQ(truth->channels[2].unit, "m");
}

TEST_F(Bag, NamesARevisionOfTheMessageThatItDoesNotRead) {
  auto bag = BagWriter::create(folder_ / "old.bag");
  ASSERT_TRUE(bag.ok());
  const RosMessageType old{"raven_2/raven_state", "0123456789abcdef0123456789abcdef",
                           "Header hdr\nint32 runlevel\n"};
  ASSERT_TRUE(bag->write("/ravenstate", old, kStart, encode_raven_state({}, true)).ok());
  ASSERT_TRUE(bag->close().ok());
  const auto recording = load("old.bag");
  ASSERT_FALSE(recording.ok());
  EXPECT_NE(recording.error().message.find("0123456789abcdef0123456789abcdef"), std::string::npos);
  EXPECT_NE(recording.error().message.find("another revision"), std::string::npos)
      << recording.error().message;
}

TEST_F(Bag, NamesTheTopicsOfABagThatHasNoStates) {
  auto bag = BagWriter::create(folder_ / "other.bag");
  ASSERT_TRUE(bag.ok());
  ASSERT_TRUE(bag->write("/joint_states", joint_state_type(), kStart,
                         encode_joint_state({kStart, {}, {1.0}, {}}))
                  .ok());
  ASSERT_TRUE(bag->close().ok());
  const auto recording = load("other.bag");
  ASSERT_FALSE(recording.ok());
  EXPECT_NE(recording.error().message.find("/joint_states (sensor_msgs/JointState)"),
            std::string::npos)
      << recording.error().message;
}

TEST_F(Bag, RefusesAStampThatRunsBackwardsUnlessToldToSkip) {
  auto bag = BagWriter::create(folder_ / "b.bag");
  ASSERT_TRUE(bag.ok());
  RavenStateMessage state;
  for (const int ms : {0, 10, 5, 20}) {
    state.stamp_ns = kStart + ms * kMs;
    ASSERT_TRUE(bag->write("/ravenstate", raven_state_type(), kStart + 30 * kMs,
                           encode_raven_state(state, true))
                    .ok());
  }
  ASSERT_TRUE(bag->close().ok());
  const auto refused = load("b.bag");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("message 3"), std::string::npos);
  LoadOptions options;
  options.skip_bad = true;
  const auto rest = load_recording(folder_ / "b.bag", options);
  ASSERT_TRUE(rest.ok()) << rest.error().message;
  EXPECT_EQ(rest->rows(), 3);
  ASSERT_EQ(rest->events.size(), 1U);
  EXPECT_EQ(rest->events[0].kind, "drop");
}

TEST_F(Bag, SaysOfEveryCutThatItIsNoWholeBag) {
  ASSERT_TRUE(export_bag(states(true, 40), profile("raven2-bag"), folder_ / "w.bag").ok());
  const auto whole = core::read_whole_file(folder_ / "w.bag");
  ASSERT_TRUE(whole.ok());
  for (std::size_t size = 0; size + 1 < whole->size(); size += 397) {
    ASSERT_TRUE(
        core::write_whole_file(folder_ / "cut.bag", std::string_view(*whole).substr(0, size)).ok());
    const auto cut = load("cut.bag");
    ASSERT_FALSE(cut.ok()) << size << " of " << whole->size();
    EXPECT_NE(cut.error().message.find("cut.bag: "), std::string::npos) << cut.error().message;
  }
}

TEST_F(Bag, ReadsOrRefusesEveryDamagedBag) {
  ASSERT_TRUE(export_bag(states(true, 40), profile("raven2-bag"), folder_ / "w.bag").ok());
  const auto whole = core::read_whole_file(folder_ / "w.bag");
  ASSERT_TRUE(whole.ok());
  std::mt19937 random(7);
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    std::string bytes = *whole;
    for (unsigned changes = 1 + random() % 4; changes > 0; --changes) {
      // The index at the end and the headers of records decide what the library does.
      const std::size_t from = random() % 2 == 0 ? bytes.size() - 2000 : 0;
      bytes[from + random() % (random() % 2 == 0 ? 2000 : bytes.size() - from)] =
          static_cast<char>(random());
    }
    ASSERT_TRUE(core::write_whole_file(folder_ / "damaged.bag", bytes).ok());
    const auto damaged = load("damaged.bag");
    if (damaged.ok()) continue;
    ++refused;
    EXPECT_NE(damaged.error().message.find("damaged.bag: "), std::string::npos)
        << damaged.error().message;
  }
  EXPECT_GT(refused, 50);
}

TEST_F(Bag, LeavesNothingOfAnExportToAFullDisk) {
  const Recording recording = states(true, 2000);
  const Profile with = profile("raven2-bag");
  for (const rlim_t room : {0, 1000, 100'000, 800'000, 1'500'000}) {
    const auto full = [&] {
      (void)std::signal(SIGXFSZ, SIG_IGN);
      const struct rlimit limit = {room, room};
      (void)::setrlimit(RLIMIT_FSIZE, &limit);
      const auto exported = export_bag(recording, with, folder_ / "f.bag");
      const bool told = !exported.ok() && exported.error().code == core::ErrorCode::kIo &&
                        exported.error().message.find("f.bag: cannot") != std::string::npos;
      return told ? 3 : 1;
    };
    EXPECT_EXIT(std::_Exit(full()), testing::ExitedWithCode(3), "") << room;
    for (const auto& file : fs::directory_iterator(folder_))
      EXPECT_EQ(file.path().filename().string().find("f.bag"), std::string::npos) << file.path();
  }
}

TEST_F(Bag, LeavesNothingBehindWhenItCannotExport) {
  Recording recording = states(true);
  recording.samples(7, *recording.column("enc.elbow")) = kLost;
  const auto refused = export_bag(recording, profile("raven2-bag"), folder_ / "n.bag");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("enc.elbow"), std::string::npos);
  recording.channels[10].name = "elsewhere";
  EXPECT_FALSE(export_bag(recording, profile("raven2-bag"), folder_ / "n.bag").ok());
  for (const auto& file : fs::directory_iterator(folder_))
    EXPECT_EQ(file.path().filename().string().find("n.bag"), std::string::npos) << file.path();
}

TEST_F(Bag, TakesTopicsAndArmFromAProfileFile) {
  auto bag = BagWriter::create(folder_ / "t.bag");
  ASSERT_TRUE(bag.ok());
  for (const char* topic : {"/ravenstate", "/ravenstate_100hz"}) {
    RavenStateMessage state;
    state.stamp_ns = kStart;
    state.values[core::catalogue_index(core::RavenField::kRunlevel, 0)] =
        std::string_view(topic) == "/ravenstate" ? 1.0 : 3.0;
    ASSERT_TRUE(
        bag->write(topic, raven_state_type(), kStart, encode_raven_state(state, true)).ok());
  }
  ASSERT_TRUE(bag->close().ok());
  const auto usual = load("t.bag");
  ASSERT_TRUE(usual.ok()) << usual.error().message;
  EXPECT_EQ(usual->samples(0, *usual->column("runlevel")), 1.0);
  const auto throttled =
      load("t.bag", std::string(RAVENCAL_SOURCE_DIR) + "/tools/profiles/raven2-bag-100hz.toml");
  ASSERT_TRUE(throttled.ok()) << throttled.error().message;
  EXPECT_EQ(throttled->samples(0, *throttled->column("runlevel")), 3.0);
}

}  // namespace
}  // namespace ravencal::record
