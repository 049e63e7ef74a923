// SPDX-License-Identifier: Apache-2.0
//
// Which weights the plugin takes from whom: signatures, and files that others may write.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "model/blob_format.hpp"
#include "model/blob_writer.hpp"
#include "rt/rig.hpp"
#include "signing/key_file.hpp"
#include "signing/sign_blob.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;
using model::packed::Precision;
using Bytes = std::vector<std::byte>;

signing::SecretKey key_of(std::uint8_t first_byte) {
  signing::SecretKey::Seed seed{};
  seed[0] = first_byte;
  return signing::SecretKey(seed);
}

Bytes read_bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
  return {bytes, bytes + text.size()};
}

fs::path write_bytes(const Bytes& bytes, const std::string& name) {
  const fs::path path = scratch_folder() / (name + ".blob");
  EXPECT_TRUE(model::write_blob(bytes, path).ok());
  return path;
}

fs::path write_signed(const std::string& name, std::uint8_t key,
                      Precision precision = Precision::kFloat32) {
  Bytes bytes = read_bytes(write_weights(make_model(8, {20}), name, precision));
  EXPECT_TRUE(signing::sign_blob(bytes, key_of(key), name).ok());
  return write_bytes(bytes, name);
}

/// A plugin that is given this key; 0: none.
class KeyedRig : public Rig {
 public:
  KeyedRig(std::uint8_t key, bool require)
      : Rig([&](ravencal_config& settings) {
          settings.require_signature = require ? 1 : 0;
          if (key == 0) return;
          const signing::PublicKey public_key = key_of(key).public_key();
          std::memcpy(settings.public_key, public_key.data(), public_key.size());
        }) {}

  std::int32_t load_file(const fs::path& path) { return api().load(instance.get(), path.c_str()); }
  [[nodiscard]] std::string last_error() const { return api().last_error(instance.get()); }
  [[nodiscard]] std::uint32_t is_signed() const {
    ravencal_info info{};
    info.struct_size = sizeof info;
    EXPECT_EQ(api().info(instance.get(), &info), RAVENCAL_SUCCESS);
    return info.is_signed;
  }

  void expect_refusal(const fs::path& path, const std::string& words) {
    EXPECT_EQ(load_file(path), RAVENCAL_ERROR_TRUST) << last_error();
    EXPECT_NE(last_error().find(words), std::string::npos) << last_error();
    EXPECT_NE(last_error().find(path.filename().string()), std::string::npos) << last_error();
  }
};

TEST(Signature, OfTheConfiguredKeyIsLoadedInEveryPrecisionAndReported) {
  KeyedRig rig(1, true);
  for (const Precision precision : {Precision::kFloat32, Precision::kBfloat16, Precision::kInt8}) {
    EXPECT_EQ(rig.load_file(write_signed("signed", 1, precision)), RAVENCAL_SUCCESS)
        << rig.last_error();
    EXPECT_EQ(rig.is_signed(), 1U);
  }
  rig.enable();
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
}

TEST(Signature, WhenRequiredRefusesWhatIsUnsignedOrOfAnotherKey) {
  KeyedRig rig(1, true);
  rig.expect_refusal(write_weights(make_model(8, {20}), "unsigned"), "not signed");
  rig.expect_refusal(write_signed("other", 2), "signed by another key");
  KeyedRig without_key(0, true);
  without_key.expect_refusal(write_signed("keyless", 1), "no public key");
}

TEST(Signature, OfAChangedBlobIsWrongAlsoBehindRightChecksums) {
  KeyedRig rig(1, true);
  const Bytes good = read_bytes(write_signed("good", 1));
  const std::size_t weights =
      model::blob::section_entry(good.data(), model::blob::kNetwork).offset +
      sizeof(model::packed::PackedHeader) + 2 * sizeof(model::packed::PackedLayer);
  Bytes bad = good;
  bad[weights] ^= std::byte{1};
  rig.load_file(write_bytes(bad, "damaged"));
  EXPECT_NE(rig.last_error().find("checksum"), std::string::npos) << rig.last_error();
  repair_checksum(bad);
  rig.expect_refusal(write_bytes(bad, "forged"), "changed after it was signed");
  // The signature itself, with its own checksum repaired: every byte of it counts.
  const std::size_t trailer = good.size() - model::blob::kTrailerBytes;
  const std::size_t at = trailer + model::blob::kSignatureAt;
  for (std::size_t i = 0; i < model::blob::kSignatureBytes; ++i) {
    bad = good;
    bad[at + i] ^= std::byte{0x80};
    EXPECT_EQ(rig.load_file(write_bytes(bad, "flipped")), RAVENCAL_ERROR_BLOB);
    const std::uint32_t crc = model::blob::crc32c(bad.data() + at, model::blob::kSignatureBytes);
    for (unsigned byte = 0; byte < 4; ++byte) {
      bad[trailer + model::blob::kSignatureChecksumAt + byte] =
          static_cast<std::byte>((crc >> (8 * byte)) & 0xFFU);
    }
    rig.expect_refusal(write_bytes(bad, "flipped"), "changed after it was signed");
  }
}

TEST(Signature, WhenNotRequiredIsCheckedWhereItIsThere) {
  KeyedRig rig(1, false);
  EXPECT_EQ(rig.load_file(write_weights(make_model(8, {20}), "plain")), RAVENCAL_SUCCESS);
  EXPECT_EQ(rig.is_signed(), 0U);
  EXPECT_EQ(rig.load_file(write_signed("right", 1)), RAVENCAL_SUCCESS);
  EXPECT_EQ(rig.is_signed(), 1U);
  rig.expect_refusal(write_signed("wrong", 2), "another key");
  KeyedRig without_key(0, false);
  EXPECT_EQ(without_key.load_file(write_signed("unknown", 1)), RAVENCAL_SUCCESS);
  EXPECT_EQ(without_key.is_signed(), 0U) << "nobody checked it";
}

TEST(Signature, RefusalLeavesTheWeightsThatRun) {
  KeyedRig rig(1, true);
  ASSERT_EQ(rig.load_file(write_signed("runs", 1)), RAVENCAL_SUCCESS);
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  rig.expect_refusal(write_signed("intruder", 2), "another key");
  for (int i = 0; i < 100; ++i) EXPECT_EQ(rig.tick(), RAVENCAL_OK);
  EXPECT_EQ(rig.is_signed(), 1U);
}

// Files that others may write.

class FileAccess : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    set_mode(folder_, 0755);
    path_ = folder_ / "w.blob";
    fs::copy_file(write_weights(make_model(8, {20}), "access"), path_,
                  fs::copy_options::overwrite_existing);
    set_mode(path_, 0644);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static void set_mode(const fs::path& path, mode_t mode) {
    ASSERT_EQ(::chmod(path.c_str(), mode), 0);
  }
  /// False, and the test is skipped, where only root could.
  [[nodiscard]] static bool is_root() { return ::geteuid() == 0; }

  KeyedRig rig_{0, false};
  fs::path folder_ = scratch_folder() / "access";
  fs::path path_;
};

TEST_F(FileAccess, LoadsWhatOnlyTheOwnerWrites) {
  for (const mode_t mode : {0644U, 0600U, 0444U, 0755U}) {
    set_mode(path_, mode);
    EXPECT_EQ(rig_.load_file(path_), RAVENCAL_SUCCESS) << rig_.last_error();
  }
}

TEST_F(FileAccess, LoadsWhatTheOwnersGroupWrites) {
  ASSERT_EQ(::chown(path_.c_str(), static_cast<uid_t>(-1), ::getegid()), 0);
  set_mode(path_, 0664);
  EXPECT_EQ(rig_.load_file(path_), RAVENCAL_SUCCESS) << rig_.last_error();
}

TEST_F(FileAccess, RefusesWhatEverybodyMayWriteAndNamesPathModeAndRemedy) {
  set_mode(path_, 0646);
  rig_.expect_refusal(path_, "0646");
  rig_.expect_refusal(path_, "chmod go-w");
  rig_.expect_refusal(path_, path_.string());
}

TEST_F(FileAccess, RefusesWhatAnotherGroupMayWrite) {
  if (!is_root()) GTEST_SKIP() << "only root can give a file to a group that it is not in";
  ASSERT_EQ(::chown(path_.c_str(), static_cast<uid_t>(-1), 54321), 0);
  set_mode(path_, 0664);
  rig_.expect_refusal(path_, "0664");
  set_mode(path_, 0644);
  EXPECT_EQ(rig_.load_file(path_), RAVENCAL_SUCCESS) << rig_.last_error();
}

TEST_F(FileAccess, RefusesWhatBelongsToAnotherUser) {
  if (!is_root()) GTEST_SKIP() << "only root can give a file away";
  ASSERT_EQ(::chown(path_.c_str(), 54321, static_cast<gid_t>(-1)), 0);
  rig_.expect_refusal(path_, "belongs to user 54321");
  ASSERT_EQ(::chown(path_.c_str(), 0, static_cast<gid_t>(-1)), 0);
  ASSERT_EQ(::chown(folder_.c_str(), 54321, static_cast<gid_t>(-1)), 0);
  rig_.expect_refusal(path_, "user 54321 owns its folder");
}

TEST_F(FileAccess, RefusesAFolderInWhichOthersMayReplaceItUnlessSticky) {
  set_mode(folder_, 0777);
  rig_.expect_refusal(path_, "chmod go-w " + folder_.string());
  rig_.expect_refusal(path_, "0777");
  set_mode(folder_, 01777);
  EXPECT_EQ(rig_.load_file(path_), RAVENCAL_SUCCESS) << rig_.last_error();
}

TEST_F(FileAccess, RefusesAFolderFartherUpThatOthersMayWrite) {
  fs::create_directories(folder_ / "a" / "b");
  fs::copy_file(path_, folder_ / "a" / "b" / "w.blob");
  EXPECT_EQ(rig_.load_file(folder_ / "a" / "b" / "w.blob"), RAVENCAL_SUCCESS) << rig_.last_error();
  set_mode(folder_ / "a", 0757);
  rig_.expect_refusal(folder_ / "a" / "b" / "w.blob", "chmod go-w " + (folder_ / "a").string());
}

TEST_F(FileAccess, RefusesALinkInAnOpenFolderAndALinkIntoOne) {
  fs::create_directories(folder_ / "open");
  fs::create_symlink(path_, folder_ / "open" / "link.blob");
  EXPECT_EQ(rig_.load_file(folder_ / "open" / "link.blob"), RAVENCAL_SUCCESS) << rig_.last_error();
  set_mode(folder_ / "open", 0777);
  rig_.expect_refusal(folder_ / "open" / "link.blob", "lets others replace it");
  fs::copy_file(path_, folder_ / "open" / "w.blob");
  fs::create_symlink(folder_ / "open" / "w.blob", folder_ / "link.blob");
  rig_.expect_refusal(folder_ / "link.blob", "lets others replace it");
}

TEST_F(FileAccess, FindsTheFoldersOfARelativePath) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  EXPECT_EQ(rig_.load_file("w.blob"), RAVENCAL_SUCCESS) << rig_.last_error();
  set_mode(folder_, 0777);
  rig_.expect_refusal("w.blob", "lets others replace it");
  fs::current_path(before);
}

TEST_F(FileAccess, DoesNotWaitForTheOtherEndOfAPipe) {
  const fs::path pipe = folder_ / "pipe.blob";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(rig_.load_file(pipe), RAVENCAL_ERROR_IO);
}

}  // namespace
}  // namespace ravencal::test
