// SPDX-License-Identifier: Apache-2.0
#include "diagnose/free_run/judge.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "diagnose/channel/across_channels.hpp"
#include "diagnose/effects/effect_kind.hpp"
#include "diagnose/effects/nominal.hpp"
#include "diagnose/findings/combinations.hpp"
#include "diagnose/findings/quantiles.hpp"
#include "diagnose/free_run/closed_loop.hpp"
#include "diagnose/free_run/fit.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool is_drive(const NamedEffect& e, const std::string& joint) {
  return e.joint == joint && e.stage == "drive" && e.id != kUnknown;
}

/// What was found in that joint's drive, with a name or without.
std::vector<NamedEffect> found_in(const Report& report, const std::string& joint) {
  std::vector<NamedEffect> found;
  for (const auto* list : {&report.effects, &report.kept}) {
    std::copy_if(list->begin(), list->end(), std::back_inserter(found),
                 [&](const NamedEffect& e) { return is_drive(e, joint); });
  }
  return found;
}

std::vector<std::string> found_keys(const std::vector<NamedEffect>& found) {
  std::vector<std::string> keys;
  for (const NamedEffect& e : found) {
    for (const NamedParameter& p : e.parameters) keys.push_back(e.id + "." + p.name);
  }
  return keys;
}

/// Handle's number in the units of the report.
double reported(const DriveHandle& handle, double x, const physics::Joint& joint) {
  const double value = handle.at(x);
  if (handle.field == physics::DriveField::kAsymmetry) return 2.0 * value;
  if (handle.field == physics::DriveField::kLevel)
    return std::max(0.0, value - joint.parameter("joint_friction", "level"));
  return value;
}

/// Deviation of a reported number that no draw knows: the drive runs under all of its friction, and
/// what of it is behind the cable is the plant's word.
double unseen_deviation(const DriveHandle& handle, const physics::Joint& joint) {
  if (handle.field != physics::DriveField::kLevel) return 0.0;
  return tolerance_of(joint, "joint_friction", "level") *
         joint.parameter("joint_friction", "level");
}

std::vector<NamedEffect> values_of(const DriveFit& fit, const physics::Joint& joint) {
  std::vector<NamedEffect> values;
  for (std::size_t h = 0; h < fit.handles.size(); ++h) {
    const DriveHandle& handle = fit.handles[h];
    if (handle.id.empty()) continue;
    VectorXd column = fit.draws.col(static_cast<Index>(h));
    std::sort(column.data(), column.data() + column.size());
    const auto at = [&](double share) {
      const auto row = static_cast<Index>(share * static_cast<double>(column.size() - 1));
      return reported(handle, column[row], joint);
    };
    const double value = reported(handle, fit.x[h], joint);
    NamedEffect e;
    e.id = handle.id;
    e.joint = joint.name;
    e.stage = "drive";
    e.out_of_tolerance = true;  // where the report has no name for it: a nominal number, moved
    // A value at its bound has all draws to one side: their scatter counts to both.
    const double middle = at(0.5);
    const double unseen = kNormal95 * unseen_deviation(handle, joint);
    const Interval ci{value - std::hypot(std::max(middle, value) - at(0.025), unseen),
                      value + std::hypot(at(0.975) - std::min(middle, value), unseen)};
    e.parameters = {{handle.parameter, value, "", ci}};
    values.push_back(std::move(e));
  }
  return values;
}

std::vector<Combination> drive_combinations(const DriveFit& fit, const std::string& joint,
                                            const std::vector<std::string>& named) {
  std::vector<CombinedParameter> parameters;
  std::vector<Index> columns;
  for (std::size_t h = 0; h < fit.handles.size(); ++h) {
    const DriveHandle& handle = fit.handles[h];
    const std::string key = handle.id + "." + handle.parameter;
    if (!handle.positive || std::find(named.begin(), named.end(), key) == named.end()) continue;
    parameters.push_back({handle.id, handle.parameter});
    columns.push_back(static_cast<Index>(h));
  }
  MatrixXd logs = fit.draws(Eigen::all, columns);
  for (Index c = 0; c < logs.cols(); ++c)
    logs.col(c).array() +=
        std::log(fit.handles[static_cast<std::size_t>(columns[static_cast<std::size_t>(c)])].value);
  std::vector<Combination> found = combinations_of(parameters, logs);
  for (Combination& c : found) {
    c.joint = joint;
    c.stage = "drive";
  }
  return found;
}

/// Numbers without an effect; false if the drive's model does not have it.
bool without(const std::string& id, const physics::Joint& joint,
             physics::DriveNumbers<double>& numbers) {
  bool had = false;
  for (const DriveParameter& p : effect_kind(id).drive_parameters()) {
    if (!p.vanishes) continue;
    had = true;
    // The drive's level is that of all dry friction, behind the cable as well.
    field_of(numbers, p.field) =
        p.field == physics::DriveField::kLevel ? joint.parameter("joint_friction", "level") : 0.0;
  }
  return had;
}

/// True if mean squares are less by more than `errors` standard errors over windows.
bool less(const VectorXd& windows, const VectorXd& than, double errors) {
  if (windows.size() < 2 || than.size() != windows.size()) return false;
  const VectorXd gain = than - windows;
  const double mean = gain.mean();
  const auto count = static_cast<double>(gain.size());
  const double variance = (gain.array() - mean).square().sum() / (count - 1.0);
  return mean > errors * std::sqrt(variance / count);
}

void add_closed_loop(const FreeRun& before, const FreeRun& after, const Series& command,
                     const physics::Plant& plant, const physics::DriveNumbers<double>& nominal,
                     const physics::DriveNumbers<double>& improved, FreeRunVerdict& verdict) {
  const Series& s = before.series();
  const physics::Joint& joint = plant.joints[plant.joint_index(s.joint).value_or(0)];
  double square[2] = {0.0, 0.0}, magnitude[2] = {0.0, 0.0}, count = 0.0;
  for (const FreeRunWindow& stretch : closed_loop_stretches(s)) {
    const ServoLaw recorded = recorded_law(command, stretch.first, stretch.last);
    if (!(recorded.position > 0.0) || recorded.rate < 0.0) continue;
    const std::vector<double> errors[2] = {
        closed_loop_errors(before, command, nominal, plant_law(joint, recorded), stretch),
        closed_loop_errors(after, command, improved, recorded, stretch)};
    for (std::size_t k = 0; k < 2; ++k) {
      for (const double e : errors[k]) {
        const double bounded = std::isfinite(e) ? std::min(std::abs(e), 1e3) : 1e3;
        square[k] += bounded * bounded;
        magnitude[k] += bounded;
      }
    }
    count += static_cast<double>(errors[0].size());
  }
  if (count == 0.0) return;
  const std::string unit = s.prismatic ? "m" : "rad";
  verdict.held_out.push_back({s.joint, "closed_loop_rmse", unit, std::sqrt(square[0] / count),
                              std::sqrt(square[1] / count), s.motion.noise});
  verdict.held_out.push_back({s.joint, "closed_loop_mae", unit, magnitude[0] / count,
                              magnitude[1] / count, s.motion.noise});
}

bool can_run(const Series& drive, const physics::Plant& plant) {
  return plant.joint_index(drive.joint).has_value() && drive.recorded.size() > 0;
}

/// One joint's drive as the improved plant has it, and the fit of its numbers.
class ImprovedDrive {
 public:
  /// `before` is the drive as `plant` has it; `improved` must outlive the object.
  ImprovedDrive(const FreeRun& before, const ChannelFindings& findings, const physics::Plant& plant,
                const physics::Plant& improved, const Report& report)
      : joint_(improved.joints[improved.joint_index(before.series().joint).value_or(0)]),
        relieved_(relieved(before.series(), findings, report)),
        free_(relieved_, improved, findings.posture),
        found_(found_in(report, joint_.name)),
        named_(found_keys(found_)),
        start_(free_.numbers(improved)),
        nominal_(before.numbers(plant)) {}
  ~ImprovedDrive() = default;
  ImprovedDrive(const ImprovedDrive&) = delete;
  ImprovedDrive& operator=(const ImprovedDrive&) = delete;

  [[nodiscard]] DriveFit fit_from(const physics::DriveNumbers<double>& start,
                                  std::uint64_t seed) const {
    const bool weight = relieved_.weight.size() > 0 && joint_.link.mass_kg > 0.0;
    return fit_drive(free_, start, drive_handles(start, nominal_, joint_, weight, named_), seed);
  }

  [[nodiscard]] const physics::Joint& joint() const { return joint_; }
  [[nodiscard]] const FreeRun& free() const { return free_; }
  [[nodiscard]] const std::vector<NamedEffect>& found() const { return found_; }
  [[nodiscard]] const std::vector<std::string>& named() const { return named_; }
  [[nodiscard]] const physics::DriveNumbers<double>& start() const { return start_; }

 private:
  /// The drive without the constant that the fit found beside its effects.
  static Series relieved(Series drive, const ChannelFindings& findings, const Report& report) {
    const bool uneven =
        std::any_of(report.effects.begin(), report.effects.end(), [&](const NamedEffect& e) {
          return e.joint == drive.joint && find_parameter(e, "level_difference") != nullptr;
        });
    drive.free_offset = uneven ? 0.0 : findings.offset;
    return drive;
  }

  const physics::Joint& joint_;
  const Series relieved_;
  const FreeRun free_;
  const std::vector<NamedEffect> found_;
  const std::vector<std::string> named_;  ///< parameters of what was found: free in fits
  const physics::DriveNumbers<double> start_, nominal_;
};

}  // namespace

bool runs_better(const VectorXd& windows, const VectorXd& than) { return less(windows, than, 1.0); }

VectorXd unseen_windows(const SeriesSet& set, const std::vector<ChannelFindings>& findings,
                        std::size_t drive, const physics::Plant& plant,
                        const physics::Plant& improved, const Report& report, std::uint64_t seed) {
  const Series& recorded = set.series[drive];
  if (!can_run(recorded, improved)) return {};
  const ImprovedDrive run(FreeRun(recorded, plant), findings[drive], plant, improved, report);
  return run.fit_from(run.start(), seed).judged_windows;
}

FreeRunVerdict judge_drive(const SeriesSet& set, const std::vector<ChannelFindings>& findings,
                           std::size_t drive, const physics::Plant& plant,
                           const physics::Plant& improved, const Report& report,
                           std::uint64_t seed) {
  FreeRunVerdict verdict;
  const Series& recorded = set.series[drive];
  if (!can_run(recorded, improved)) return verdict;
  const FreeRunRows rows = recorded.any_held_out() ? FreeRunRows::kHeldOut : FreeRunRows::kTraining;
  const FreeRun before(recorded, plant);
  const ImprovedDrive run(before, findings[drive], plant, improved, report);
  const physics::Joint& joint = run.joint();
  const DriveFit fit = run.fit_from(run.start(), seed);
  if (fit.better()) {
    verdict.values = values_of(fit, joint);
    verdict.combinations = drive_combinations(fit, recorded.joint, run.named());
  }
  for (const NamedEffect& e : run.found()) {
    physics::DriveNumbers<double> lacking = run.start();
    if (e.out_of_tolerance || !without(e.id, joint, lacking)) continue;
    // Every free run has a constant of its own, which says the same.
    if (is_dry_asymmetry(e)) continue;
    const DriveFit rival = run.fit_from(lacking, seed);
    // What passed the gates of held-out effort is lost to clearly better runs, not to chance.
    if (less(rival.judged_windows, fit.judged_windows, kNormal95)) verdict.demoted.push_back(e.id);
  }

  const std::vector<FreeRunWindow> windows = free_run_windows(recorded, rows);
  const physics::DriveNumbers<double> nominal = before.numbers(plant);
  const double was = rms_of(free_run_errors(before, nominal, windows));
  const double is = rms_of(free_run_errors(run.free(), fit.numbers, windows));
  if (was >= 0.0 && is >= 0.0) {
    verdict.held_out.push_back({recorded.joint, "free_run_1s_rmse",
                                recorded.prismatic ? "m" : "rad", was, is, recorded.motion.noise});
  }
  for (const Series& series : set.series) {
    if (series.joint != recorded.joint || series.stage != Stage::kCommand) continue;
    add_closed_loop(before, run.free(), series, plant, nominal, fit.numbers, verdict);
  }
  return verdict;
}

namespace {

/// What screening measured stays the report's: there the error is an effort and the motion is known
/// to a percent, so that least squares are right. An open-loop run turns every disturbance of
/// the effort into a position far off, and numbers that damp it look better than the true ones;
/// they are the plant's that predicts such runs. Numbers that screening only moved are theirs.
void adopt(const NamedParameter& refitted, NamedParameter& p) {
  if (p.ci95.first < p.ci95.second) {
    p.running = refitted.value;
    return;
  }
  p.value = refitted.value;
  p.ci95 = refitted.ci95;
}

/// Gives the drive's refitted number to whom it belongs: what was found, or the plant.
void write_back(const NamedEffect& value, Report& report) {
  const NamedParameter& refitted = value.parameters.front();
  for (auto* list : {&report.effects, &report.kept, &report.refitted}) {
    for (NamedEffect& e : *list) {
      if (e.joint != value.joint || e.stage != "drive" || e.id != value.id) continue;
      const auto p =
          std::find_if(e.parameters.begin(), e.parameters.end(),
                       [&](const NamedParameter& own) { return own.name == refitted.name; });
      if (p == e.parameters.end()) continue;
      adopt(refitted, *p);
      return;
    }
  }
  report.refitted.push_back(value);
}

/// Takes the name from an effect of the drive; its error is then unexplained.
void demote(const std::string& id, const Series& drive, Report& report) {
  const auto is_it = [&](const NamedEffect& e) { return is_drive(e, drive.joint) && e.id == id; };
  std::erase_if(report.kept, is_it);
  const auto it = std::find_if(report.effects.begin(), report.effects.end(), is_it);
  if (it == report.effects.end()) return;
  const bool told = std::any_of(
      report.unexplained.begin(), report.unexplained.end(),
      [&](const Unexplained& u) { return u.joint == drive.joint && u.stage == "drive"; });
  if (!told) {
    Unexplained u;
    u.joint = drive.joint;
    u.stage = "drive";
    u.share_of_excess = std::clamp(held_out_share(*it), 0.0, 1.0);
    u.size = it->size;
    u.unit = it->unit;
    report.unexplained.push_back(std::move(u));
  }
  report.effects.erase(it);
}

}  // namespace

void apply(const FreeRunVerdict& verdict, const Series& drive, Report& report) {
  report.held_out.insert(report.held_out.end(), verdict.held_out.begin(), verdict.held_out.end());
  report.combinations.insert(report.combinations.end(), verdict.combinations.begin(),
                             verdict.combinations.end());
  for (const NamedEffect& value : verdict.values) write_back(value, report);
  for (const std::string& id : verdict.demoted) demote(id, drive, report);
}

}  // namespace ravencal::diagnose
