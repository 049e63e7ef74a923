// SPDX-License-Identifier: Apache-2.0
#include "learn/recordings_at_hook.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "learn/file_hash.hpp"
#include "model/feature_matrix.hpp"
#include "model/hook_view.hpp"

namespace ravencal::learn {

namespace {

using record::Recording;

/// Rows of a control cycle each, but for jitter.
bool has_every_cycle(const Recording& recording) {
  const double period_s = model::row_period_s(recording);
  return period_s > 0.5 * model::kControlCycleS && period_s < 1.5 * model::kControlCycleS;
}

}  // namespace

bool is_at_hook(Latched latched, const Recording& recording) {
  return latched == Latched::kOn || (latched == Latched::kAuto && has_every_cycle(recording));
}

RecordingsAtHook::RecordingsAtHook(std::span<const Recording* const> recordings, bool at_hook)
    : recordings_(recordings.begin(), recordings.end()) {
  if (!at_hook) return;
  changed_.reserve(recordings.size());
  for (const Recording*& recording : recordings_) {
    changed_.push_back(model::as_seen_at_hook(*recording));
    recording = &changed_.back();
  }
}

std::string files_text(std::span<const Recording* const> recordings) {
  std::vector<std::string> files;
  for (const Recording* recording : recordings) {
    const std::filesystem::path path(recording->source);
    const auto hash = sha256_of_file(path);
    files.push_back(
        fmt::format("{} sha256:{}", path.filename().string(), hash.ok() ? *hash : "unknown"));
  }
  return fmt::format("{}", fmt::join(files, "; "));
}

void keep_with(model::CalibrationModel& model, const std::vector<std::string>& implausible) {
  if (!implausible.empty())
    model.provenance["implausible"] = fmt::format("{}", fmt::join(implausible, "; "));
}

bool was_trained_on(const model::CalibrationModel& model, const Recording& recording) {
  const auto trained = model.provenance.find("recordings");
  const auto hash = sha256_of_file(recording.source);
  return trained != model.provenance.end() && hash.ok() &&
         trained->second.find(*hash) != std::string::npos;
}

}  // namespace ravencal::learn
