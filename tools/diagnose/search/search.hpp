// SPDX-License-Identifier: Apache-2.0
//
// From the plant as it is to the models that explain the recordings best: effects are added where
// the screen calls for them, taken out where they are not missed, and every model is fitted whole.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "diagnose/model/model.hpp"
#include "diagnose/search/screen.hpp"
#include "diagnose/vocabulary/vocabulary.hpp"

namespace ravencal::diagnose {

class Search {
 public:
  /// All must outlive the search; it aims the vocabulary's jumps and tones. `alpha`: chance of a
  /// false name.
  Search(Likelihood& training, Likelihood* held_out, Vocabulary& vocabulary, double alpha,
         std::uint64_t seed);

  /// `go_on`: asked between models; false ends the search.
  void run(const std::function<bool()>& go_on);

  /// Models that were judged, the best first. Never empty after run().
  [[nodiscard]] std::vector<const Model*> ranked() const;
  [[nodiscard]] const Model& best() const { return *ranked().front(); }
  [[nodiscard]] double alpha() const { return alpha_; }
  [[nodiscard]] double dispersion() const { return training_.dispersion(); }
  /// Greatest change that what distinguishes two models makes in any channel, as a share of what
  /// the richer one leaves there.
  [[nodiscard]] double size_between(const Model& richer, const Model& other) const;
  /// What one model gains over another on the recordings that no fit saw or, without any, what its
  /// blocks gain together less 2.5 standard errors; over the dispersion.
  [[nodiscard]] double unseen_gain(const Model& richer, const Model& poorer) const;
  /// Whether what it gains there is worth a change of the plant, and its squared error over the
  /// floors falls as well.
  [[nodiscard]] bool pays(const Model& richer, const Model& poorer) const;
  /// Whether a candidate changes what it says by enough in any channel: as a share of what is left
  /// there, and of what all else changes.
  [[nodiscard]] bool shows(const Model& with_it, const Model& without_it,
                           std::size_t candidate) const;
  /// Whether the interval of what a candidate adds to the written model, as wide as the judged one
  /// and the way between the two say, is as far from nothing as a name of its kind asks for.
  [[nodiscard]] bool certain(const Model& judged, const Model& written,
                             std::size_t candidate) const;

 private:
  using Key = std::set<std::size_t>;
  struct Judged {
    Model model;
    bool expanded = false;
    bool too_small = false;  ///< one of its effects is not worth a name
  };

  void start();
  void expand(const Key& key, std::size_t most, std::optional<std::size_t> joint = {});
  void add_all(const Model& model, const std::map<std::size_t, std::pair<double, Hit>>& of_joint);
  void try_without(const Key& key);
  void judge_anew();
  Judged& consider(Model model);
  void take_dispersion_of(Model& model);
  [[nodiscard]] bool worth_trying(const Hit& hit, const Key& key,
                                  std::set<std::string>& shapes) const;
  [[nodiscard]] Eigen::VectorXd sizes_between(const Model& richer, const Model& other) const;

  [[nodiscard]] bool too_small(const Model& with_it, const Key& without_it,
                               std::size_t candidate) const;
  [[nodiscard]] double acting_size(const Model& model, std::size_t presence) const;
  [[nodiscard]] double size_z(const Model& judged, const Model& written,
                              std::size_t candidate) const;
  [[nodiscard]] bool has_no_moment(const Model& without_it, const Hit& jump) const;
  [[nodiscard]] bool passes(const Key& key);
  [[nodiscard]] Model as_given(const Model& model) const;
  [[nodiscard]] double gain_left_out(const Model& richer, const Model& poorer) const;
  [[nodiscard]] double cost_of(const Key& key) const;
  void refine_moment(const Model& model, Hit& hit);
  [[nodiscard]] std::vector<const Judged*> in_order() const;

  Likelihood& training_;
  Likelihood* held_out_;
  Vocabulary& vocabulary_;
  double alpha_;
  std::uint64_t seed_;
  std::map<Key, Judged> judged_;
  std::function<bool()> go_on_;
};

struct Limit {
  std::size_t candidate = 0;
  double size = 0.0;  ///< of its first parameter, in that parameter's unit
  /// False: whatever its size, the model's own parameters can make nearly all of what it changes.
  bool apart = true;
};

/// Of every candidate with a name that the best model lacks, at the start where it is seen least: a
/// size that is named nine times in ten.
std::vector<Limit> limits(const Search& search, const Likelihood& training,
                          const Vocabulary& vocabulary);

}  // namespace ravencal::diagnose
