// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "cli/exit_code.hpp"
#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"
#include "core/whole_file.hpp"
#include "model/blob_signature.hpp"
#include "model/blob_writer.hpp"
#include "signing/key_file.hpp"
#include "signing/sign_blob.hpp"

namespace ravencal::commands {
namespace {

struct SignArguments {
  std::string weights;
  std::string key;
  std::string new_key;
  std::string public_key;
  bool json = false;
};

core::Result<std::vector<std::byte>> read_bytes(const std::string& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
  return std::vector<std::byte>(bytes, bytes + text.size());
}

core::Status generate(const SignArguments& arguments) {
  RAVENCAL_ASSIGN_OR_RETURN(const signing::PublicKey key, signing::generate_key(arguments.new_key));
  core::say("{}: secret key, keep it where only you can read it\n{}.pub: public key {}\n",
            arguments.new_key, arguments.new_key, signing::hex(key));
  return {};
}

core::Status sign(const SignArguments& arguments) {
  if (arguments.weights.empty() || arguments.key.empty()) {
    return core::Error{core::ErrorCode::kUsage,
                       "give weights and --key KEY, or one of keygen, verify; see --help"};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const signing::SecretKey key, signing::read_secret_key(arguments.key));
  RAVENCAL_ASSIGN_OR_RETURN(std::vector<std::byte> bytes, read_bytes(arguments.weights));
  RAVENCAL_RETURN_IF_ERROR(signing::sign_blob(bytes, key, arguments.weights));
  RAVENCAL_RETURN_IF_ERROR(model::write_blob(bytes, arguments.weights));
  core::say("{}: signed, public key {}\n", arguments.weights, signing::hex(key.public_key()));
  return {};
}

struct Verdict {
  const char* name;
  const char* sentence;
};

Verdict verdict_of(model::SignatureStatus status) {
  switch (status) {
    case model::SignatureStatus::kValid:
      return {"valid", "signed by this key, and unchanged since"};
    case model::SignatureStatus::kMissing:
      return {"missing", "not signed"};
    case model::SignatureStatus::kWrong:
      break;
  }
  return {"wrong", "signed by another key, or changed after it was signed"};
}

core::Status verify(const SignArguments& arguments, int& exit_code) {
  RAVENCAL_ASSIGN_OR_RETURN(const signing::PublicKey key,
                            signing::read_public_key(arguments.public_key));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::byte> bytes, read_bytes(arguments.weights));
  model::BlobView view;
  const model::BlobCheck check = model::BlobView::open(bytes, view);
  if (!check.ok()) {
    return core::Error{core::ErrorCode::kData, fmt::format("{}: {} (byte {})", arguments.weights,
                                                           describe(check.status), check.offset)};
  }
  const model::SignatureStatus status = model::verify_signature(view, key);
  const Verdict verdict = verdict_of(status);
  if (arguments.json) {
    const nlohmann::ordered_json json = {{"file", arguments.weights},
                                         {"public_key", signing::hex(key)},
                                         {"signature", verdict.name}};
    core::say("{}\n", json.dump(2));
  } else {
    core::say("{}: {}\n", arguments.weights, verdict.sentence);
  }
  if (status != model::SignatureStatus::kValid) exit_code = cli::kFinding;
  return {};
}

cli::Paths public_key_beside(const CLI::App& command) {
  return {cli::path_of(command, "--out").string() + ".pub"};
}

}  // namespace

void add_sign(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<SignArguments>();
  CLI::App* command = app.add_subcommand("sign", "Sign weights, so that robots load no others");
  command->add_option("weights", arguments->weights, "Weights to sign, in place (.blob)");
  command->add_option("--key", arguments->key, "Secret key of `ravencal sign keygen`");
  command->footer(
      "A plugin whose configuration holds the public key and require_signature loads only weights "
      "signed with the secret one.\n"
      "Examples:\n"
      "  ravencal sign keygen --out lab.key\n"
      "  ravencal sign weights.blob --key lab.key\n"
      "  ravencal sign verify weights.blob --public lab.key.pub");

  CLI::App* keygen = command->add_subcommand("keygen", "Make a pair of keys");
  keygen->add_option("--out", arguments->new_key, "Secret key to write; the public one gets .pub")
      ->required();
  keygen->footer("Example: ravencal sign keygen --out lab.key");

  CLI::App* verification = command->add_subcommand("verify", "Check who signed weights");
  verification->add_option("weights", arguments->weights, "Weights to check (.blob)")->required();
  verification->add_option("--public", arguments->public_key, "Public key (KEY.pub)")->required();
  verification->add_flag("--json", arguments->json, "For programs");
  verification->footer(
      "Exit code 1: not signed, or not by this key.\n"
      "Example: ravencal sign verify weights.blob --public lab.key.pub");

  command->require_subcommand(0, 1);
  on_call(*keygen, exit_code,
          {.written = {"--out"}, .also_written = public_key_beside, .can_force = false},
          [=] { return generate(*arguments); });
  on_call(*verification, exit_code, {.read = {"weights", "--public"}},
          [=, &exit_code] { return verify(*arguments, exit_code); });
  on_call(*command, exit_code, {.read = {"--key"}, .changed = {"weights"}}, [=]() -> core::Status {
    if (keygen->parsed() || verification->parsed()) return {};
    return sign(*arguments);
  });
}

}  // namespace ravencal::commands
