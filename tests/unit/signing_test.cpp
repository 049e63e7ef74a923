// SPDX-License-Identifier: Apache-2.0
//
// Keys and signatures, as a library and as `ravencal sign`.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "model/blob_signature.hpp"
#include "model/blob_writer.hpp"
#include "signing/key_file.hpp"
#include "signing/sign_blob.hpp"
#include "unit/blob_sample.hpp"
#include "unit/run_command.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;
using model::BlobView;
using model::SignatureStatus;
using Bytes = std::vector<std::byte>;

class Signing : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    ASSERT_TRUE(model::write_blob(golden_model(), folder_ / "w.blob").ok());
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// `ravencal sign ARGUMENTS`, run in the folder.
  [[nodiscard]] Outcome sign(const std::string& arguments) const {
    const std::string command =
        fmt::format("cd '{}' && '{}' sign {} 2>&1", folder_.string(), RAVENCAL_PROGRAM, arguments);
    return run_command(command);
  }

  [[nodiscard]] std::string content(const std::string& name) const {
    std::ifstream file(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  fs::path folder_ = fs::temp_directory_path() / fmt::format("ravencal_signing_{}", ::getpid());
};

// RFC 8032, 7.1, test 1: seed and public key.
TEST_F(Signing, DerivesThePublicKeyOfThePublishedVector) {
  write("k",
        "ravencal-secret-key-ed25519 "
        "9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60\n");
  ASSERT_EQ(::chmod((folder_ / "k").c_str(), 0600), 0);
  const auto key = signing::read_secret_key(folder_ / "k");
  ASSERT_TRUE(key.ok()) << key.error().message;
  EXPECT_EQ(signing::hex(key->public_key()),
            "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a");
}

TEST_F(Signing, SignedWeightsVerifyWithTheirKeyOnlyAndReadBackTheSame) {
  EXPECT_EQ(sign("keygen --out a.key").exit_code, 0);
  EXPECT_EQ(sign("keygen --out b.key").exit_code, 0);
  const Outcome before = sign("verify w.blob --public a.key.pub");
  EXPECT_EQ(before.exit_code, 1);
  EXPECT_NE(before.text.find("not signed"), std::string::npos) << before.text;
  const Outcome signed_now = sign("w.blob --key a.key");
  EXPECT_EQ(signed_now.exit_code, 0) << signed_now.text;
  EXPECT_EQ(sign("verify w.blob --public a.key.pub").exit_code, 0);
  const Outcome other = sign("verify w.blob --public b.key.pub");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.text.find("another key"), std::string::npos) << other.text;
  EXPECT_NE(sign("verify w.blob --public b.key.pub --json").text.find("\"signature\": \"wrong\""),
            std::string::npos);
  const auto model = model::read_blob(folder_ / "w.blob");
  ASSERT_TRUE(model.ok()) << model.error().message;
  EXPECT_EQ(model->layers[0].weights, golden_model().layers[0].weights);
  EXPECT_NE(model::describe_blob(folder_ / "w.blob")->find("Ed25519"), std::string::npos);
  // Another key replaces the signature.
  EXPECT_EQ(sign("w.blob --key b.key").exit_code, 0);
  EXPECT_EQ(sign("verify w.blob --public b.key.pub").exit_code, 0);
  EXPECT_EQ(sign("verify w.blob --public a.key.pub").exit_code, 1);
}

TEST_F(Signing, SameKeyAndBlobGiveTheSameBytes) {
  ASSERT_EQ(sign("keygen --out a.key").exit_code, 0);
  ASSERT_EQ(sign("w.blob --key a.key").exit_code, 0);
  const std::string once = content("w.blob");
  ASSERT_EQ(sign("w.blob --key a.key").exit_code, 0);
  EXPECT_EQ(content("w.blob"), once);
}

TEST_F(Signing, KeysAreForTheirOwnerAloneAndNeverOverwritten) {
  ASSERT_EQ(sign("keygen --out a.key").exit_code, 0);
  struct stat status = {};
  ASSERT_EQ(::stat((folder_ / "a.key").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777U, 0600U);
  const std::string key = content("a.key");
  const Outcome again = sign("keygen --out a.key");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.text.find("never overwritten"), std::string::npos) << again.text;
  EXPECT_EQ(content("a.key"), key);
  // A public key in the way leaves no secret one behind.
  write("c.key.pub", "in the way");
  EXPECT_EQ(sign("keygen --out c.key").exit_code, 3);
  EXPECT_FALSE(fs::exists(folder_ / "c.key"));
}

TEST_F(Signing, KeepsTheModeOfTheWeights) {
  ASSERT_EQ(sign("keygen --out a.key").exit_code, 0);
  for (const mode_t mode : {0600U, 0640U, 0400U, 0664U}) {
    ASSERT_EQ(::chmod((folder_ / "w.blob").c_str(), mode), 0);
    ASSERT_EQ(sign("w.blob --key a.key").exit_code, 0);
    struct stat status = {};
    ASSERT_EQ(::stat((folder_ / "w.blob").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 07777U, mode);
  }
}

TEST_F(Signing, RefusesASecretKeyThatOthersMayUse) {
  ASSERT_EQ(sign("keygen --out a.key").exit_code, 0);
  const std::string before = content("w.blob");
  for (const mode_t mode : {0640U, 0604U, 0660U, 0644U}) {
    ASSERT_EQ(::chmod((folder_ / "a.key").c_str(), mode), 0);
    const Outcome outcome = sign("w.blob --key a.key");
    EXPECT_EQ(outcome.exit_code, 3);
    EXPECT_NE(outcome.text.find(fmt::format("{:04o}", mode)), std::string::npos) << outcome.text;
    EXPECT_NE(outcome.text.find("chmod 600"), std::string::npos) << outcome.text;
  }
  EXPECT_EQ(content("w.blob"), before);
}

TEST_F(Signing, RefusesWhatIsNoKeyAndWhatIsNoBlob) {
  ASSERT_EQ(sign("keygen --out a.key").exit_code, 0);
  const std::string key = content("a.key");
  for (const std::string& bad :
       {std::string(), std::string("x"), key.substr(0, key.size() - 2), key + "0", "r" + key,
        key.substr(0, 30) + "g" + key.substr(31), content("a.key.pub")}) {
    write("bad.key", bad);
    ASSERT_EQ(::chmod((folder_ / "bad.key").c_str(), 0600), 0);
    EXPECT_EQ(sign("w.blob --key bad.key").exit_code, 3) << bad;
  }
  EXPECT_EQ(sign("verify w.blob --public a.key").exit_code, 3) << "a secret key is no public key";
  EXPECT_EQ(sign("w.blob --key none.key").exit_code, 3);
  write("damaged.blob", content("w.blob").substr(0, 500));
  EXPECT_EQ(sign("damaged.blob --key a.key").exit_code, 3);
  EXPECT_EQ(sign("verify damaged.blob --public a.key.pub").exit_code, 3);
  EXPECT_EQ(sign("").exit_code, 2);
  EXPECT_EQ(sign("w.blob").exit_code, 2);
}

TEST_F(Signing, EveryByteOfASignedBlobCounts) {
  const signing::SecretKey key{signing::SecretKey::Seed{}};
  Bytes good = golden_bytes();
  ASSERT_TRUE(signing::sign_blob(good, key, "golden").ok());
  BlobView view;
  ASSERT_TRUE(BlobView::open(good, view).ok());
  ASSERT_EQ(verify_signature(view, key.public_key()), SignatureStatus::kValid);
  for (std::size_t at = 0; at < good.size(); ++at) {
    Bytes bad = good;
    for (unsigned bit = 0; bit < 8; ++bit) {
      bad[at] = good[at] ^ static_cast<std::byte>(1U << bit);
      const model::BlobCheck check = BlobView::open(bad, view);
      ASSERT_FALSE(check.ok()) << "byte " << at << " bit " << bit;
      ASSERT_STRNE(describe(check.status), "unknown reason");
    }
    ASSERT_FALSE(BlobView::open(std::span(good).first(at), view).ok());
    // Behind the checksum: the signature.
    bad[at] = good[at] ^ std::byte{1};
    repair_checksum(bad);
    if (bad != good && BlobView::open(bad, view).ok()) {  // the checksum is mended to itself
      ASSERT_EQ(verify_signature(view, key.public_key()), SignatureStatus::kWrong) << at;
    }
  }
}

}  // namespace
}  // namespace ravencal::test
