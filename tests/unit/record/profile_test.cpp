// SPDX-License-Identifier: Apache-2.0
#include "record/profile.hpp"

#include <gtest/gtest.h>

#include <map>

#include "core/catalogue.hpp"
#include "scratch.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;

std::map<std::string, ProfileChannel> raven2(const std::string& arm) {
  std::map<std::string, ProfileChannel> channels;
  const auto profile = load_profile("raven2", {arm});
  EXPECT_TRUE(profile.ok());
  for (const ProfileChannel& channel : profile->channels) channels[channel.channel.name] = channel;
  return channels;
}

// Zero-based columns as bag_reader/run_r2_bag_readers_sync.py writes them.
TEST(Raven2Profile, ReadsTheAuthorsColumns) {
  const auto channels = raven2("gold");
  EXPECT_EQ(channels.size(), 3 + core::kCatalogueSize);
  const std::map<std::string, std::size_t> expected = {{"truth.shoulder", 1},
                                                       {"truth.insertion", 3},
                                                       {"time", 12},
                                                       {"jpos.shoulder", 13},
                                                       {"other.jpos.shoulder", 21},
                                                       {"runlevel", 29},
                                                       {"last_seq", 31},
                                                       {"pos.x", 34},
                                                       {"other.pos.x", 37},
                                                       {"ori.r11", 40},
                                                       {"enc.shoulder", 82},
                                                       {"dac.elbow", 99},
                                                       {"tau.elbow", 115},
                                                       {"mpos.shoulder", 130},
                                                       {"other.mpos.shoulder", 138},
                                                       {"jpos_d.grasp2", 201},
                                                       {"grasp_d", 210},
                                                       {"enc_offset.shoulder", 212},
                                                       {"jac_f.0", 240},
                                                       {"other.jac_f.5", 251}};
  for (const auto& [name, index] : expected) {
    ASSERT_TRUE(channels.contains(name)) << name;
    EXPECT_EQ(channels.at(name).index, index) << name;
  }
}

TEST(Raven2Profile, SwapsTheHalvesForTheGreenArm) {
  const auto green = raven2("green");
  EXPECT_EQ(green.at("jpos.shoulder").index, 21U);
  EXPECT_EQ(green.at("other.jpos.shoulder").index, 13U);
  EXPECT_EQ(green.at("pos.z").index, 39U);
  EXPECT_EQ(green.at("runlevel").index, 29U);
  EXPECT_EQ(green.at("truth.elbow").index, 2U);
}

TEST(Raven2Profile, GivesRolesToTheCalibratedArmOnly) {
  const auto channels = raven2("gold");
  EXPECT_EQ(channels.at("jpos.insertion").channel.role, Role::kJointEstimate);
  EXPECT_EQ(channels.at("jpos.insertion").channel.unit, "m_x_180_over_pi");
  EXPECT_EQ(channels.at("jpos.wrist").channel.role, Role::kFeature);
  EXPECT_EQ(channels.at("other.jpos.elbow").channel.role, Role::kFeature);
  EXPECT_EQ(channels.at("other.jpos.elbow").channel.joint, "");
  EXPECT_EQ(channels.at("mpos.elbow").channel.role, Role::kMotorPosition);
  EXPECT_EQ(channels.at("mpos.void").channel.role, Role::kFeature);
  EXPECT_EQ(channels.at("tau.elbow").channel.joint, "elbow");
  EXPECT_EQ(channels.at("runlevel").channel.role, Role::kStatus);
  EXPECT_FALSE(load_profile("raven2", {"left"}).ok());
}

struct WrongProfile {
  std::string text;
  std::string complaint;
};

TEST(ProfileFile, NamesFileAndLineOfEveryMistake) {
  const std::string channel = "[[channel]]\nname = 'a'\ncolumn = 'a'\nunit = 'rad'\n";
  const WrongProfile wrong[] = {
      {"[source]\nformt = 'csv'\n" + channel, ":2: unknown key 'formt' in [source]"},
      {"[source]\n[[channel]]\nname = 'a'\ncolumn = 'a'\nunit = 'furlong'\n",
       ":5: channel a: unknown unit 'furlong'; known: 1, rad, deg"},
      {"[source]\n[[channel]]\nname = 'a'\ncolumn = 'a'\nunit = 'rad'\nrole = 'x'\n",
       ":6: channel a: unknown role 'x'; known: desired_position, "},
      {"[source]\n[[channel]]\nname = 'a'\ncolumn = 'a'\nunit = 'degg'\n",
       "did you mean 'deg'? known: "},
      {"[source]\n[[channel]]\nname = 'a'\ncolumn = 'a'\nunit = 'rad'\nrole = 'joint_thruth'\n",
       "did you mean 'joint_truth'? known: "},
      {"[source]\n[[channel]]\nname = 'a'\nunit = 'rad'\n", ":2: give either column"},
      {"[source]\n[[channel]]\nname = 'a'\ncolumn = 'a'\nindex = 1\nunit = 'rad'\n",
       ":2: give either column"},
      {"[source]\n[[channel]]\nname = 'a'\nindex = -1\nunit = 'rad'\n",
       ":4: index must be a whole number"},
      {"[source]\ntime_unit = 'deg'\n" + channel, ":2: time_unit 'deg'"},
      {"[source]\nreference = 'last'\n" + channel, ":1: reference can only"},
      {"[source]\nformat = 'bag'\nhomed = true\n" + channel, ":1: homed is for tables"},
      {"[source]\nheader = 1\n" + channel, ":2: header must be true or false"},
      {"[source]\n" + channel + "[[filter]]\ncolumn = 'a'\n", ":6: keep is missing"},
      {"[source]\n" + channel + "negate = true\nscale = -1\n",
       ":6: a channel has either negate or scale"},
      {"[source]\n" + channel + "scale = 0\n", ":6: scale must not be 0"},
      {"[source]\n" + channel + "offset = nan\n", ":6: offset must be"},
      {"[sauce]\n" + channel, ":1: a profile needs a [source] table"},
      {"[source]\n", ": a profile needs [[channel]] tables"},
      {"channel = 3\n[source]\n", ":1: write [[channel]] tables"},
      {"[source\n", ":1: "},
  };
  const Scratch scratch;
  for (const WrongProfile& w : wrong) {
    const auto path = scratch.write("p.toml", w.text);
    const auto profile = load_profile(path.string());
    ASSERT_FALSE(profile.ok()) << w.text;
    EXPECT_EQ(profile.error().code, core::ErrorCode::kData);
    EXPECT_TRUE(profile.error().message.starts_with(path.string() + ":"))
        << profile.error().message;
    EXPECT_NE(profile.error().message.find(w.complaint), std::string::npos)
        << profile.error().message << "\nwanted: " << w.complaint;
  }
  EXPECT_EQ(load_profile("no_such_profile").error().code, core::ErrorCode::kUsage);
}

TEST(ProfileFile, EveryShippedProfileIsRead) {
  int count = 0;
  for (const auto& file :
       std::filesystem::directory_iterator(RAVENCAL_SOURCE_DIR "/tools/profiles")) {
    const auto profile = load_profile(file.path().string());
    EXPECT_TRUE(profile.ok()) << profile.error().message;
    ++count;
  }
  EXPECT_GE(count, 6);
}

}  // namespace
}  // namespace ravencal::record
