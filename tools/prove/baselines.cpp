// SPDX-License-Identifier: Apache-2.0
#include "prove/baselines.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "prove/black_box.hpp"

namespace ravencal::prove {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Json = nlohmann::ordered_json;

double rms(const VectorXd& x) { return std::sqrt(x.squaredNorm() / static_cast<double>(x.size())); }

struct Fitted {
  double before = 0.0, after = 0.0;
};

/// Coefficients from one library, figures on another with the same columns.
Fitted held_out_figures(const TermLibrary& fit, const TermLibrary& test,
                        const std::vector<std::size_t>& groups) {
  const auto columns = [&groups](const TermLibrary& lib) {
    MatrixXd x = lib.nuisance;
    for (const std::size_t g : groups) {
      const MatrixXd& more = lib.groups[g].columns;
      x.conservativeResize(lib.y.size(), x.cols() + more.cols());
      x.rightCols(more.cols()) = more;
    }
    return x;
  };
  const MatrixXd x = columns(fit);
  if (x.cols() == 0) return {rms(test.y), rms(test.y)};
  MatrixXd normal = x.transpose() * x;
  normal.diagonal() *= 1.0 + 1e-9;
  normal.diagonal().array() += 1e-300;
  return {rms(test.y), rms(test.y - columns(test) * normal.ldlt().solve(x.transpose() * fit.y))};
}

using Select = std::vector<std::size_t> (*)(const TermLibrary&);

std::vector<std::size_t> everything(const TermLibrary& library) {
  std::vector<std::size_t> all(library.groups.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

/// One channel of one joint, on both runs.
struct Task {
  std::string joint, metric;
  TermLibrary fit, test;
};

Json figure(const Task& task, const Fitted& f) {
  return {{"joint", task.joint}, {"metric", task.metric}, {"before", f.before}, {"after", f.after}};
}

void select_with(Select select, const Task& task, Json& out) {
  const auto chosen = select(task.fit);
  Json& named = out["named"];
  for (const std::size_t g : chosen) {
    const Json entry = {{"id", task.fit.groups[g].id}, {"joint", task.joint}};
    if (std::find(named.begin(), named.end(), entry) == named.end()) named.push_back(entry);
  }
  out["held_out"].push_back(figure(task, held_out_figures(task.fit, task.test, chosen)));
}

}  // namespace

Json run_baselines(const record::Recording& recording, const record::Recording& held_out,
                   const NominalRobot& plant) {
  constexpr std::pair<const char*, Select> kMethods[] = {
      {"bic_forward", bic_forward}, {"stlsq", stlsq}, {"lasso", lasso}, {"everything", everything}};
  Json out;
  for (const auto& [method, select] : kMethods)
    out[method] = {{"named", Json::array()}, {"held_out", Json::array()}};
  Json& network = out["black_box"] = {{"named", nullptr}, {"held_out", Json::array()}};
  for (std::size_t joint = 0; joint < plant.joints.size(); ++joint) {
    const std::string& name = plant.joints[joint].name;
    const Signals fit = signals_of(recording, plant, joint),
                  test = signals_of(held_out, plant, joint);
    std::vector<Task> tasks;
    if (fit.truth.size() > 0)
      tasks.push_back({name, "position_rmse", position_library(fit, plant, joint),
                       position_library(test, plant, joint)});
    if (fit.effort.size() > 0)
      tasks.push_back({name, "effort_rmse", drive_library(fit, plant, joint),
                       drive_library(test, plant, joint)});
    for (const Task& task : tasks) {
      for (const auto& [method, select] : kMethods) select_with(select, task, out[method]);
      const double after = black_box_rmse(fit, task.fit.y, test, task.test.y);
      network["held_out"].push_back(figure(task, {rms(task.test.y), after}));
    }
  }
  return out;
}

}  // namespace ravencal::prove
