// SPDX-License-Identifier: Apache-2.0
#include "diagnose/search/search.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {

using Eigen::VectorXd;

namespace {

/// Rounds beside one for each joint.
constexpr int kRounds = 5;
/// Fits of the plant alone with the noise estimated anew.
constexpr int kStartRounds = 2;
constexpr std::size_t kFirstBreadth = 6;
constexpr std::size_t kBreadth = 4;
constexpr std::size_t kNarrow = 2;
/// Candidates that turn out not to be worth a name take no place of others, up to so many times it.
constexpr std::size_t kMostRefused = 3;
/// Models this close to the best are expanded as well, so many of them.
constexpr double kCloseScore = 30.0;
constexpr std::size_t kClose = 3;
constexpr std::ptrdiff_t kMostEffects = 4;  // of one joint
constexpr std::size_t kKeptModels = 5;
constexpr std::size_t kMostShapes = 2;
constexpr int kMomentPasses = 4;

/// A size at its bound is that of something else.
bool ends_at_bound(const Model& model, const Candidate& candidate, std::size_t place) {
  for (std::size_t a = 0; a < candidate.sizes.size(); ++a)
    if (model.effects.at(place)[a].at_bound()) return true;
  return false;
}

double least_unseen(const Candidate& candidate) {
  return candidate.unnamed() ? kClearGain : kLeastUnseenGain;
}

double counted(double dispersion) { return std::clamp(dispersion, 1.0, kMostDispersion); }

}  // namespace

Search::Search(Likelihood& training, Likelihood* held_out, Vocabulary& vocabulary, double alpha,
               std::uint64_t seed)
    : training_(training),
      held_out_(held_out),
      vocabulary_(vocabulary),
      alpha_(alpha),
      seed_(seed) {}

void Search::run(const std::function<bool()>& go_on) {
  go_on_ = go_on;
  start();
  Key last;
  const int rounds = kRounds + static_cast<int>(training_.base().plant.joints.size());
  for (int round = 0; round < rounds && go_on_(); ++round) {
    expand(in_order().front()->model.chosen, round == 0 ? kFirstBreadth : kBreadth);
    const std::vector<const Judged*> order = in_order();
    for (std::size_t i = 1; i < std::min(kClose, order.size()); ++i) {
      const bool close =
          order[i]->model.judgement.score < order[0]->model.judgement.score + kCloseScore;
      if (close && !order[i]->expanded && !order[i]->model.chosen.empty())
        expand(order[i]->model.chosen, kNarrow);
    }
    try_without(in_order().front()->model.chosen);
    const Key now = in_order().front()->model.chosen;
    if (now == last || now.empty()) break;
    last = now;
    judge_anew();
  }
  while (go_on_() && !passes(in_order().front()->model.chosen)) {
  }
}

/// Asks again for all names together, by the last noise; a model that does not hold all of its
/// names is out.
bool Search::passes(const Key& key) {
  for (const std::size_t candidate : key) {
    Model less = without(judged_[key].model, vocabulary_, candidate);
    const Key smaller = less.chosen;
    if (!judged_.contains(smaller)) consider(std::move(less));
    const Model& with_it = judged_[key].model;
    const Model& without_it = judged_[smaller].model;
    const double likelier =
        without_it.judgement.score_at(dispersion()) - with_it.judgement.score_at(dispersion());
    const Candidate& added = vocabulary_.candidates[candidate];
    const bool asked = held_out_ == nullptr && !added.searched();
    if (likelier < kLeastLikelier || too_small(with_it, smaller, candidate) ||
        (asked && gain_left_out(with_it, without_it) < least_unseen(added))) {
      judged_[key].too_small = true;
      return false;
    }
  }
  return true;
}

void Search::start() {
  Model model;
  model.numbers = vocabulary_.numbers;
  // Pulses stand out by themselves. Noise that held them would hide everything else.
  State begins = training_.base();
  for (std::size_t c = 0; c < vocabulary_.candidates.size(); ++c) {
    if (vocabulary_.candidates[c].kind != CandidateKind::kPulses) continue;
    model = with(model, vocabulary_, {.candidate = c, .sizes = VectorXd::Ones(1)});
    for (const Parameter& p : model.effects.at(c)) p.apply(begins);
  }
  training_.estimate_noise(begins);
  for (int round = 0; round < kStartRounds; ++round) {
    fit(training_, model);
    const State state = model.state_for(training_);
    training_.move_links(state);
    training_.estimate_noise(state);
  }
  if (held_out_ != nullptr) held_out_->take_noise(training_);
  fit(training_, model);
  judge(training_, 0.0, model);
  training_.set_dispersion(counted(model.judgement.dispersion));
  fit(training_, model);
  judge(training_, 0.0, model);
  Model bare = model;
  for (const std::size_t c : model.chosen) bare = without(bare, vocabulary_, c);
  if (!model.chosen.empty()) fit(training_, bare);
  judge(training_, 0.0, bare);
  judged_[Key{}].model = std::move(bare);
  if (!model.chosen.empty()) consider(std::move(model));
}

double Search::cost_of(const Key& key) const {
  double cost = 0.0;
  for (const std::size_t c : key) {
    const Candidate& candidate = vocabulary_.candidates[c];
    cost += kEffectCost * (candidate.unnamed() ? 2.0 : 1.0);
    double parameters = candidate.opens ? 1.0 : 0.0;
    for (const auto* list : {&candidate.sizes, &candidate.forms})
      for (const Parameter& p : *list) parameters += p.held ? 0.0 : 1.0;
    // A moment and a frequency were searched for, and the two ends of every pulse.
    if (candidate.searched()) parameters += 2.0;
    if (candidate.kind == CandidateKind::kPulses)
      parameters += 2.0 * static_cast<double>(candidate.forms.size());
    cost += kParameterCost * parameters;
  }
  return cost;
}

Search::Judged& Search::consider(Model model) {
  fit(training_, model);
  judge(training_, cost_of(model.chosen), model);
  take_dispersion_of(model);
  const Key key = model.chosen;
  const auto [at, is_new] = judged_.try_emplace(key);
  if (is_new || model.judgement.score < at->second.model.judgement.score)
    at->second.model = std::move(model);
  return at->second;
}

/// What a model lacks looks like noise that is correlated. Where a richer model is better even at
/// its own dispersion, that one holds for all (Burnham and Anderson 2002, 2.5: of the global
/// model).
void Search::take_dispersion_of(Model& model) {
  const double own = counted(model.judgement.dispersion);
  if (own >= dispersion()) return;
  const double best = in_order().front()->model.judgement.score_at(own);
  if (model.judgement.score_at(own) >= best) return;
  training_.set_dispersion(own);
  model.judgement.score = model.judgement.score_at(own);
  for (auto& [key, judged] : judged_)
    judged.model.judgement.score = judged.model.judgement.score_at(own);
}

bool Search::worth_trying(const Hit& hit, const Key& key, std::set<std::string>& shapes) const {
  const Candidate& candidate = vocabulary_.candidates[hit.candidate];
  const double gain = hit.gain / dispersion();
  // By blocks, whatever the dispersion.
  if (std::max(gain, hit.statistic) < kLeastGain) return false;
  const bool found = candidate.stated_orders && hit.start >= *candidate.stated_orders;
  if (found && gain < kLeastToneGain) return false;
  switch (candidate.kind) {
    case CandidateKind::kJump:
      return gain >= kLeastJumpGain;
    case CandidateKind::kTone:
      if (gain < kLeastToneGain || hit.statistic < kLeastToneStatistic) return false;
      break;
    default:
      if (gain < kClearGain && hit.p_value > alpha_) return false;
  }
  if (!candidate.unnamed()) return true;
  if (gain < kClearGain) return false;
  const auto held = static_cast<std::size_t>(std::count_if(
      key.begin(), key.end(), [&](std::size_t c) { return vocabulary_.candidates[c].unnamed(); }));
  // Neighbouring places of one shape say the same.
  const std::string& kind = candidate.circumstance;
  return held < kMostShapes && shapes.insert(kind.substr(0, kind.find(" at "))).second;
}

void Search::expand(const Key& key, std::size_t most, std::optional<std::size_t> joint) {
  judged_[key].expanded = true;
  const Model model = judged_[key].model;
  aim(training_, held_out_, model, vocabulary_);
  std::set<std::string> shapes;
  std::map<std::size_t, std::pair<double, Hit>> of_joint;  // gained, by which
  std::size_t tried = 0, refused = 0;
  for (Hit& hit : screen(training_, model, vocabulary_, seed_, joint)) {
    if (tried == most || refused == kMostRefused * most || !go_on_()) break;
    if (!worth_trying(hit, key, shapes)) continue;
    Key larger = key;
    larger.insert(hit.candidate);
    if (judged_.contains(larger)) {
      ++tried;
      continue;
    }
    if (vocabulary_.candidates[hit.candidate].kind == CandidateKind::kJump) {
      refine_moment(model, hit);
      if (has_no_moment(model, hit)) {
        ++refused;
        continue;
      }
    }
    Judged& considered = consider(with(model, vocabulary_, hit));
    considered.too_small = too_small(considered.model, key, hit.candidate);
    ++(considered.too_small ? refused : tried);
    const double gained = model.judgement.score_at(dispersion()) - considered.model.judgement.score;
    if (considered.too_small || gained <= 0.0) continue;
    auto& [most_gained, best] = of_joint[vocabulary_.candidates[hit.candidate].joint];
    if (gained <= most_gained) continue;
    most_gained = gained;
    best = hit;
  }
  add_all(model, of_joint);
}

/// What joints lack hardly depends on each other: the best of each at once.
void Search::add_all(const Model& model,
                     const std::map<std::size_t, std::pair<double, Hit>>& of_joint) {
  if (of_joint.size() < 2 || !go_on_()) return;
  Model all = model;
  for (const auto& [joint, best] : of_joint) all = with(all, vocabulary_, best.second);
  if (!judged_.contains(all.chosen)) consider(std::move(all));
}

void Search::try_without(const Key& key) {
  const Model model = judged_[key].model;
  for (const std::size_t candidate : key) {
    if (!go_on_()) return;
    Model less = without(model, vocabulary_, candidate);
    const Key smaller = less.chosen;
    if (!judged_.contains(smaller)) consider(std::move(less));
    // Beside what was added later, and by the noise estimated since, it may explain too little.
    if (too_small(model, smaller, candidate)) judged_[key].too_small = true;
    if (smaller.empty()) continue;
    // In its place something else of the same joint may be there.
    const std::size_t joint = vocabulary_.candidates[candidate].joint;
    const auto beside = std::count_if(smaller.begin(), smaller.end(), [&](std::size_t c) {
      return vocabulary_.candidates[c].joint == joint;
    });
    if (!judged_[smaller].expanded && beside + 1 < kMostEffects) expand(smaller, kNarrow, joint);
  }
}

bool Search::too_small(const Model& with_it, const Key& without_it, std::size_t candidate) const {
  const Candidate& added = vocabulary_.candidates[candidate];
  if (added.is_presence() && acting_size(with_it, candidate) < kLeastActingSize) return true;
  if (!certain(with_it, with_it, candidate)) return true;
  if (!added.is_presence() && ends_at_bound(with_it, added, candidate)) return true;
  if (added.opens) {
    const Parameter& closed = vocabulary_.numbers[*added.opens];
    const double off = with_it.numbers[*added.opens].x - closed.mean;
    if (std::abs(off) <= kWrongBy * closed.deviation) return true;
  }
  const Model& smaller = judged_.at(without_it).model;
  if (!added.searched() && !added.is_presence() &&
      unseen_gain(with_it, smaller) < least_unseen(added))
    return true;
  // Without a number that is wrong, others at the ends of their tolerance stand in for it.
  Model back = with_it;
  if (added.opens) back.numbers[*added.opens].x = vocabulary_.numbers[*added.opens].mean;
  return !shows(with_it, added.opens ? back : smaller, candidate);
}

bool Search::shows(const Model& with_it, const Model& without_it, std::size_t candidate) const {
  const VectorXd sizes = sizes_between(with_it, without_it);
  const VectorXd of_others = sizes_between(without_it, as_given(without_it));
  const double least =
      vocabulary_.candidates[candidate].unnamed() ? kLeastShapeSize : kLeastNamedSize;
  return (sizes.array() >= (kLeastBesideOthers * of_others).array().max(least)).any();
}

/// The plant as it was given, beside effects whose form cannot be wrong.
Model Search::as_given(const Model& model) const {
  Model given = model;
  for (std::size_t n = 0; n < given.numbers.size(); ++n)
    if (given.numbers[n].in_plant) given.numbers[n].x = vocabulary_.numbers[n].mean;
  std::erase_if(given.effects,
                [&](const auto& effect) { return !vocabulary_.candidates[effect.first].constant; });
  return given;
}

/// A jump has a moment: the rows tell it from one some seconds before or after.
bool Search::has_no_moment(const Model& without_it, const Hit& jump) const {
  Candidate elsewhere = vocabulary_.candidates[jump.candidate];
  const double moment_s = elsewhere.starts[jump.start][0];
  double greatest = 0.0;
  for (const double off_s : {-kMomentKnown_s, kMomentKnown_s}) {
    elsewhere.starts = {{moment_s + off_s}};
    for (const Hit& hit : screen_one(training_, without_it, elsewhere))
      greatest = std::max(greatest, hit.gain);
  }
  return jump.gain - greatest < kLeastMomentGain * dispersion();
}

/// Finer around the best moment, several times.
void Search::refine_moment(const Model& model, Hit& hit) {
  Candidate candidate = vocabulary_.candidates[hit.candidate];
  double moment_s = candidate.starts[hit.start][0];
  double reach_s = 2.0 * training_.tracks().front().period_s *
                   static_cast<double>(training_.tracks().front().tent_rows);
  for (int pass = 0; pass < kMomentPasses; ++pass) {
    candidate.starts.clear();
    for (int k = -4; k <= 4; ++k) candidate.starts.push_back({moment_s + 0.25 * reach_s * k});
    const std::vector<Hit> hits = screen_one(training_, model, candidate);
    if (hits.empty()) break;
    moment_s = candidate.starts[hits[0].start][0];
    hit.sizes = hits[0].sizes;
    hit.gain = hits[0].gain;
    reach_s *= 0.25;
  }
  std::vector<std::vector<double>>& starts = vocabulary_.candidates[hit.candidate].starts;
  starts.push_back({moment_s});
  hit.start = starts.size() - 1;
}

/// The noise of the best model so far is what the others are judged by.
void Search::judge_anew() {
  const std::vector<const Judged*> order = in_order();
  std::set<Key> kept = {Key{}};
  for (std::size_t i = 0; i < std::min(kKeptModels, order.size()); ++i)
    kept.insert(order[i]->model.chosen);
  Model best = order.front()->model;
  std::erase_if(judged_, [&](const auto& entry) { return !kept.contains(entry.first); });
  const State state = best.state_for(training_);
  training_.move_links(state);
  training_.estimate_noise(state);
  judge(training_, cost_of(best.chosen), best);
  training_.set_dispersion(counted(best.judgement.dispersion));
  for (auto& [key, judged] : judged_) {
    fit(training_, judged.model);
    judge(training_, cost_of(key), judged.model);
    judged.expanded = false;
  }
  if (held_out_ != nullptr) held_out_->take_noise(training_);
}

std::vector<const Search::Judged*> Search::in_order() const {
  std::vector<const Judged*> order;
  for (const auto& [key, judged] : judged_)
    if (!judged.too_small) order.push_back(&judged);
  std::stable_sort(order.begin(), order.end(), [](const Judged* a, const Judged* b) {
    return a->model.judgement.score < b->model.judgement.score;
  });
  return order;
}

std::vector<const Model*> Search::ranked() const {
  std::vector<const Model*> models;
  for (const Judged* judged : in_order()) models.push_back(&judged->model);
  return models;
}

}  // namespace ravencal::diagnose
