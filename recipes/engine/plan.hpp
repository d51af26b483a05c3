#pragma once
// The plan: a recipe checked against a rig, in SI units, immutable. All checks have passed when a
// Plan exists.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocols/base/phase.hpp"
#include "recipes/engine/handover.hpp"
#include "recipes/engine/rig_limits.hpp"
#include "recipes/engine/sweep.hpp"
#include "recipes/kinematics/kinematics.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::recipes {

/// One phase of an exploration. Fields that a phase does not use are zero or empty.
struct PhaseStep {
  Phase phase = Phase::none;
  double duration_s = 0;  ///< S, P, E: recorded time. M: derived from path, speed and acceleration
  double force_n = 0;     ///< P, M: set point of the force loop, along the plate's normal
  double force_band_n = 0;   ///< P, M: |force - set point| that counts as regulated
  double depth_m = 0;        ///< P, without a force sensor: z below the touch of the taxels
  double speed_mps = 0;      ///< M: along the path
  std::vector<Vec2> path_m;  ///< M: corner points relative to the start of the path, without (0, 0)
};

/// Ends a stroke as soon as the live vote is sure, as at the end of its path.
struct StopEarly {
  double sure_probability = 0;  ///< least probability of the fabric that the vote names
  double least_slide_s = 0;     ///< least duration of phase M before the vote counts as sure
};

/// A trained model that classifies during the stroke.
struct LiveVote {
  std::string model;                    ///< file, relative to the recipe's folder
  std::optional<StopEarly> stop_early;  ///< nullopt: the model votes and nothing else happens
};

/// An exploration: phases S, P, M, E in this order (paper, section III-B). A press for an imprint
/// has S, P, E and no stroke.
struct Exploration {
  std::string name;  ///< "M1"
  std::vector<PhaseStep> phases;
  Vec2 start_m;  ///< touch-down point on the fabric, fabric frame
  std::optional<LiveVote> live_vote = {};
  std::vector<double> factors = {};  ///< SI, in the order of Plan::sweep's factors; may be empty

  /// The exploration must have the phase.
  [[nodiscard]] const PhaseStep& step(Phase phase) const;
  /// It has a phase M; otherwise it is a press.
  [[nodiscard]] bool slides() const;
  /// The last phase with a regulated force: M, or P for a press.
  [[nodiscard]] Phase held_phase() const { return slides() ? Phase::motion : Phase::press; }
  /// Corner points of phase M; empty for a press.
  [[nodiscard]] const std::vector<Vec2>& path_m() const;
};

/// The properties that one repetition shares with the next. The default is that of a bench with a
/// fabric that is fastened once (as in the paper, section IV-A): the same path on the same
/// mounting.
struct Repetition {
  enum class Path : std::uint8_t {
    same,      ///< retraced
    new_patch  ///< elsewhere on the mounted piece
  };
  Path path = Path::same;
  std::uint32_t remount_every = 0;  ///< trials of one mounting; 0: only when the fabric changes
  std::uint32_t pieces = 1;         ///< of each fabric; they share the repetitions in order
  bool operator==(const Repetition&) const = default;
};

/// The part of its fabric that a trial touches, counted from 1 for each fabric.
struct TrialPlace {
  std::uint32_t piece = 1;
  std::uint32_t mounting = 1;  ///< in order of execution: mountings of this fabric so far
  std::uint32_t patch = 1;
  Vec2 offset_m;  ///< of the path from the start of the exploration
  bool operator==(const TrialPlace&) const = default;
};

/// Seeds for simulated fabric, one for each level of variation between trials. Each depends on its
/// own level alone, so another order of trials, or missing ones, change no other trial.
struct TrialSeeds {
  std::uint64_t piece = 0;     ///< from recipe seed, fabric and piece
  std::uint64_t mounting = 0;  ///< from recipe seed, fabric and mounting
  std::uint64_t touch = 0;     ///< see patch_seed()
};

/// One trial: a fabric, an exploration and a repetition.
struct TrialSpec {
  std::size_t index = 0;         ///< position in the order of the campaign
  std::size_t fabric = 0;        ///< index into Plan::fabrics
  std::size_t exploration = 0;   ///< index into Plan::explorations
  std::uint32_t repetition = 1;  ///< from 1
  TrialPlace place;
  TrialSeeds seeds;
};

struct Approach {
  double speed_mps = 2e-3;           ///< down to first contact
  double seat_speed_mps = 0.5e-3;    ///< from first contact until the fabric carries the probe
  double contact_force_n = 0.1;      ///< first contact
  double transfer_speed_mps = 4e-3;  ///< every move without contact
};

/// When a regulated force counts as settled.
struct Settle {
  double dwell_s = 0.5;  ///< inside the band for this time without a break
  double timeout_s = 30;
};

enum class OnTrialFailure { stop, carry_on };

/// A trial with a bad record is kept, marked, and repeated.
struct RepeatBad {
  std::uint32_t at_most = 0;            ///< further attempts of one trial
  double lost_fraction = 0.01;          ///< frames or readings of one sensor; a larger share is bad
  double saturated_fraction = 0.01;     ///< frames of any one taxel; a larger share is bad
  double still_taxel_s = 1;             ///< a taxel without change for this time is dead
  double force_in_band_fraction = 0.8;  ///< of phase M; a smaller share is bad
};

/// Marks in the text of an operator step, for the name of the fabric and its place in the recipe,
/// from 1.
inline constexpr std::string_view fabric_mark = "{fabric}", number_mark = "{number}";
/// Marks for the piece of the fabric and its mounting number, both from 1.
inline constexpr std::string_view piece_mark = "{piece}", mounting_mark = "{mounting}";

/// A task of a person between trials, while the stages are at rest and the probe is up.
struct OperatorStep {
  enum class Before : std::uint8_t {
    campaign,  ///< once, and again when an interrupted campaign is resumed
    fabric,    ///< each time the fabric changes, and on resuming
    mounting   ///< each time a fabric is mounted, and on resuming
  };
  Before before = Before::campaign;
  std::vector<std::size_t> fabrics;  ///< indices into Plan::fabrics of its fabrics; empty: all
  std::string text;                  ///< the prompt, with marks in it
  double people_s = 0;               ///< usual duration [s]
};

/// Target of the x and y stages, at the clear height [m, stage positions].
struct ParkStep {
  double x_m = 0, y_m = 0;
};
/// The rig does not move.
struct WaitStep {
  double duration_s = 0;
};
/// A final step of the rig after the last trial, with the probe retracted.
using LastStep = std::variant<ParkStep, WaitStep>;

/// Final steps by the outcome of the campaign. They are skipped if the probe is not known to be up.
struct Finally {
  std::vector<LastStep> on_success;  ///< complete
  std::vector<LastStep> on_stop;     ///< stopped or aborted
  std::vector<LastStep> on_fault;    ///< failed
  double budget_s = 300;             ///< time limit of all final steps; the rest is skipped
};

/// Duration, data and travel of the campaign, computed before anything moves.
struct Forecast {
  double duration_s = 0;    ///< machine time, without people_s
  double finally_s = 0;     ///< part of duration_s: the final steps of a complete campaign
  double people_s = 0;      ///< for all operator steps
  std::size_t prompts = 0;  ///< number of operator prompts
  std::size_t mounts = 0;   ///< number of mountings
  [[nodiscard]] double total_s() const { return duration_s + people_s; }
  [[nodiscard]] double trials_s() const { return duration_s - finally_s; }
  std::uint64_t bytes = 0;                   ///< recorded samples, before compression
  std::array<Range, axis_count> envelope{};  ///< stage positions used [m, rad]
  std::array<double, axis_count> margin{};   ///< least distance to the end of travel [m, rad]
  std::array<bool, axis_count> fixed{};      ///< axes without a stage
  /// Least and greatest set point, including the probe's weight; nullopt without a force sensor.
  std::optional<Range> force_n;
};

/// Common part of recipe and plan.
struct RecipeTerms {
  std::string name;
  std::uint64_t seed = 1;
  std::vector<std::string> fabrics;
  std::vector<std::string> class_of;  ///< of each fabric; empty: the recipe has no classes
  Approach approach;
  Settle settle;
  Repetition repetition;
  OnTrialFailure on_trial_failure = OnTrialFailure::stop;
  std::optional<RepeatBad> repeat_bad;  ///< nullopt: no quality check of the records
  std::vector<OperatorStep> operator_steps;
  Finally finally;
  std::optional<Handover> handover;  ///< nullopt: only the data set is written
  std::optional<Sweep> sweep;        ///< nullopt: every exploration as the recipe states it
  double mount_timeout_s = 600;      ///< a person may have to change the fabric
};

struct Plan : RecipeTerms {
  std::vector<Exploration> explorations;  ///< with a sweep: one for each cell
  std::vector<TrialSpec> trials;          ///< in order of execution
  RigLimits limits;
  Forecast forecast;
  /// The recipe in normal form (sorted keys, SI units, defaults filled in), to be hashed for
  /// provenance. Two texts that plan the same campaign have the same normal form.
  std::string canonical_json;
};

/// "trial 3 (denim, M2, repetition 1)", counted from 1, for messages. `trial` is below the number
/// of trials.
std::string format_trial(const Plan& plan, std::size_t trial);

/// Largest number of attempts of a trial.
inline std::uint32_t most_attempts(const Plan& plan) {
  return 1 + (plan.repeat_bad ? plan.repeat_bad->at_most : 0);
}

/// All problems together. `plan` is present exactly when `problems` is empty.
struct CheckReport {
  std::optional<Plan> plan;
  std::vector<Diagnostic> problems;
  std::vector<Diagnostic> warnings;
  /// The resolved recipe, which is recorded. It is the given text if there are no parameters, or if
  /// there is a problem.
  std::string recipe_json = {};
  std::string parameters_json = "{}";  ///< as declared in the recipe
};

/// Longest accepted recipe; a longer one is refused by its size alone.
inline constexpr std::size_t max_recipe_bytes = std::size_t{1} << 20;
inline constexpr std::size_t max_trials = 1'000'000;

/// Parses, resolves and checks a recipe against a rig. `seed` replaces the recipe's own, which is
/// checked nevertheless. `values_json`: {NAME: value} of its parameters, or empty
/// (recipes/schema/parameters.hpp). Never throws; any text is a valid input.
CheckReport check_recipe(std::string_view recipe_json, const RigLimits& limits,
                         std::optional<std::uint64_t> seed = {}, std::string_view values_json = {});

/// The trials on one fabric, an index into Plan::fabrics, as a plan of their own: renumbered from
/// 0, with their own forecast and without a handover. Seeds and places stay, so these trials touch
/// what they touch in the whole campaign.
Plan part_on(Plan plan, std::size_t fabric);

/// The seed of a trial's touch: FNV-1a 64 over the decimal seed, fabric, exploration and
/// repetition, separated by '/', then mixed by splitmix64.
std::uint64_t patch_seed(std::uint64_t recipe_seed, std::string_view fabric,
                         std::string_view exploration, std::uint32_t repetition);

/// Time of a rest-to-rest move under a speed and an acceleration limit: trapezoid, or triangle when
/// distance < speed^2 / acceleration [s].
double move_duration_s(double distance_m, double speed_mps, double acceleration_mps2);

// Time, bytes and envelope of a plan, from the moves that the engine will command.

Forecast forecast(const Plan& plan);

/// Expected time of one trial [s], coming from `from_m` (fabric frame) at the clear height. The
/// time for changing the fabric is not included.
double trial_duration_s(const Plan& plan, const TrialSpec& trial, Vec2 from_m);

/// Times of all trials of the plan in order [s], including the way to the first one. Their sum is
/// the forecast's trials_s().
std::vector<double> trial_durations_s(const Plan& plan);

/// Time of phase M [s]: the probe stops at every corner.
double motion_duration_s(const Exploration& exploration, double acceleration_mps2);

}  // namespace weft::recipes
