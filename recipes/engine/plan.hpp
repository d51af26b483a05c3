#pragma once
// The plan: a recipe checked against a rig, in SI units, immutable from here on. Everything that
// can be refused has been refused when a Plan exists.

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
  double depth_m = 0;        ///< P, without a force sensor: z below where the taxels touched
  double speed_mps = 0;      ///< M: along the path
  std::vector<Vec2> path_m;  ///< M: corner points relative to the start of the path, without (0, 0)
};

/// When a slide has told enough: it ends then as at the end of its path.
struct StopEarly {
  double sure_probability = 0;  ///< of the fabric that the vote is for
  double least_slide_s = 0;     ///< of phase M, before which nothing is sure
};

/// A trained model that is asked while the slide goes on.
struct LiveVote {
  std::string model;                    ///< file, from the recipe's folder
  std::optional<StopEarly> stop_early;  ///< without it the model votes and nothing follows
};

/// An exploratory movement: phases S, P, M, E in this order (paper, section III-B), or S, P, E: a
/// press without a slide, for a static imprint.
struct Exploration {
  std::string name;  ///< "M1"
  std::vector<PhaseStep> phases;
  Vec2 start_m;  ///< where on the cloth the probe touches down, fabric frame
  std::optional<LiveVote> live_vote = {};
  std::vector<double> factors = {};  ///< SI, in the order of Plan::sweep's factors; or none

  /// It must have the phase.
  [[nodiscard]] const PhaseStep& step(Phase phase) const;
  /// It has a phase M; otherwise it presses and stands still.
  [[nodiscard]] bool slides() const;
  /// The last phase under a regulated force: M, or P where it stands still.
  [[nodiscard]] Phase held_phase() const { return slides() ? Phase::motion : Phase::press; }
  /// Corner points of phase M; none where it stands still.
  [[nodiscard]] const std::vector<Vec2>& path_m() const;
};

/// What one repetition has in common with the next. Default: what a bench does whose cloth is
/// fastened once (as in the paper, section IV-A): the same path on the same mounted piece.
struct Repetition {
  enum class Path : std::uint8_t {
    same,      ///< retraced
    new_patch  ///< elsewhere on the mounted piece
  };
  Path path = Path::same;
  std::uint32_t remount_every = 0;  ///< trials of one mounting; 0: only where the cloth changes
  std::uint32_t pieces = 1;         ///< of each fabric, which share the repetitions in order
  bool operator==(const Repetition&) const = default;
};

/// What of its cloth a trial touches, counted from 1 for each fabric.
struct TrialPlace {
  std::uint32_t piece = 1;
  std::uint32_t mounting = 1;  ///< in order of execution: how often this fabric was put on
  std::uint32_t patch = 1;
  Vec2 offset_m;  ///< of the path from the exploration's start
  bool operator==(const TrialPlace&) const = default;
};

/// For simulated cloth, one for each level of what differs between trials. Each depends on its own
/// level alone, so that the order of trials, or leaving some out, changes no other.
struct TrialSeeds {
  std::uint64_t piece = 0;     ///< of recipe seed, fabric and piece
  std::uint64_t mounting = 0;  ///< of recipe seed, fabric and mounting
  std::uint64_t touch = 0;     ///< see patch_seed()
};

/// One experiment: a fabric, an exploration and a repetition.
struct TrialSpec {
  std::size_t index = 0;         ///< position in the campaign's order
  std::size_t fabric = 0;        ///< into Plan::fabrics
  std::size_t exploration = 0;   ///< into Plan::explorations
  std::uint32_t repetition = 1;  ///< from 1
  TrialPlace place;
  TrialSeeds seeds;
};

struct Approach {
  double speed_mps = 2e-3;           ///< down to first contact
  double seat_speed_mps = 0.5e-3;    ///< from first contact until the cloth bears the probe
  double contact_force_n = 0.1;      ///< first contact
  double transfer_speed_mps = 4e-3;  ///< every move that does not touch the cloth
};

/// When a regulated force counts as settled.
struct Settle {
  double dwell_s = 0.5;  ///< inside the band for this long without a break
  double timeout_s = 30;
};

enum class OnTrialFailure { stop, carry_on };

/// A repetition whose record is bad is kept, marked, and taken again.
struct RepeatBad {
  std::uint32_t at_most = 0;            ///< further takes of one repetition
  double lost_fraction = 0.01;          ///< of the frames or readings of one sensor: more is bad
  double saturated_fraction = 0.01;     ///< of the frames, for any one taxel: more is bad
  double still_taxel_s = 1;             ///< a taxel that stays the same for so long is dead
  double force_in_band_fraction = 0.8;  ///< of phase M: less is bad
};

/// What stands for the fabric in the text of an operator step: its name, its place in the recipe
/// from 1.
inline constexpr std::string_view fabric_mark = "{fabric}", number_mark = "{number}";
/// And for the piece of it and how often it was put on, likewise from 1.
inline constexpr std::string_view piece_mark = "{piece}", mounting_mark = "{mounting}";

/// What a person does between trials, while the stages are at rest and the probe is up.
struct OperatorStep {
  enum class Before : std::uint8_t {
    campaign,  ///< once, and again when an interrupted campaign is gone on with
    fabric,    ///< each time the fabric changes, and likewise
    mounting   ///< each time a cloth is put on, and likewise
  };
  Before before = Before::campaign;
  std::vector<std::size_t> fabrics;  ///< into Plan::fabrics, those it is for; empty: every one
  std::string text;                  ///< what is asked, with the marks in it
  double people_s = 0;               ///< how long people usually take [s]
};

/// Where the x and y stages go, at the clear height [m, stage positions].
struct ParkStep {
  double x_m = 0, y_m = 0;
};
/// The rig stands still.
struct WaitStep {
  double duration_s = 0;
};
/// What the rig does once no trial is left, the probe up.
using LastStep = std::variant<ParkStep, WaitStep>;

/// By how the campaign ends. Nothing of it is done where the probe is not known to be up.
struct Finally {
  std::vector<LastStep> on_success;  ///< complete
  std::vector<LastStep> on_stop;     ///< stopped or aborted
  std::vector<LastStep> on_fault;    ///< failed
  double budget_s = 300;             ///< for all of it; what is not done by then is left out
};

/// What the campaign will take, worked out before anything moves.
struct Forecast {
  double duration_s = 0;    ///< of the machine; people's time is beside it
  double finally_s = 0;     ///< of that, what is done once no trial is left of a complete campaign
  double people_s = 0;      ///< for all operator steps
  std::size_t prompts = 0;  ///< how often people are asked
  std::size_t mounts = 0;   ///< how often a cloth is put on the plate
  [[nodiscard]] double total_s() const { return duration_s + people_s; }
  [[nodiscard]] double trials_s() const { return duration_s - finally_s; }
  std::uint64_t bytes = 0;                   ///< recorded samples, before compression
  std::array<Range, axis_count> envelope{};  ///< stage positions used [m, rad]
  std::array<double, axis_count> margin{};   ///< least distance to the end of travel [m, rad]
  std::array<bool, axis_count> fixed{};      ///< axes without a stage
  /// Least and greatest set point, the probe's weight included; none without a force sensor.
  std::optional<Range> force_n;
};

/// What recipe and plan have in common.
struct RecipeTerms {
  std::string name;
  std::uint64_t seed = 1;
  std::vector<std::string> fabrics;
  std::vector<std::string> class_of;  ///< of each fabric; empty: the recipe has no classes
  Approach approach;
  Settle settle;
  Repetition repetition;
  OnTrialFailure on_trial_failure = OnTrialFailure::stop;
  std::optional<RepeatBad> repeat_bad;  ///< none: no repetition is judged
  std::vector<OperatorStep> operator_steps;
  Finally finally;
  std::optional<Handover> handover;  ///< none: the data set is all there is
  std::optional<Sweep> sweep;        ///< none: every exploration as the recipe states it
  double mount_timeout_s = 600;      ///< a person may have to change the cloth
};

struct Plan : RecipeTerms {
  std::vector<Exploration> explorations;  ///< of a sweep: one for each cell
  std::vector<TrialSpec> trials;          ///< in order of execution
  RigLimits limits;
  Forecast forecast;
  /// The recipe in normal form (sorted keys, SI units, defaults filled in): hash this for
  /// provenance. Two texts that plan the same campaign have the same normal form.
  std::string canonical_json;
};

/// "trial 3 (denim, M2, repetition 1)", counted from 1 as people do, for sentences. `trial` is
/// below the number of trials.
std::string format_trial(const Plan& plan, std::size_t trial);

/// How many takes there are of a repetition at most.
inline std::uint32_t most_attempts(const Plan& plan) {
  return 1 + (plan.repeat_bad ? plan.repeat_bad->at_most : 0);
}

/// All problems at once. `plan` is there exactly when `problems` is empty.
struct CheckReport {
  std::optional<Plan> plan;
  std::vector<Diagnostic> problems;
  std::vector<Diagnostic> warnings;
  /// The resolved recipe, which is what is recorded: the text as given where it has no parameters,
  /// or a problem.
  std::string recipe_json = {};
  std::string parameters_json = "{}";  ///< as the recipe declares them
};

/// Longest recipe that is looked at; a longer one is refused by its size alone.
inline constexpr std::size_t max_recipe_bytes = std::size_t{1} << 20;
inline constexpr std::size_t max_trials = 1'000'000;

/// Parses, resolves and checks a recipe against a rig. `seed` takes the place of the recipe's own,
/// which is checked all the same. `values_json`: {NAME: value} of its parameters, or empty
/// (recipes/schema/parameters.hpp). Never throws; any text is an input.
CheckReport check_recipe(std::string_view recipe_json, const RigLimits& limits,
                         std::optional<std::uint64_t> seed = {}, std::string_view values_json = {});

/// The seed of a trial's touch: FNV-1a 64 over the decimal seed, fabric, exploration and
/// repetition, separated by '/', then mixed by splitmix64.
std::uint64_t patch_seed(std::uint64_t recipe_seed, std::string_view fabric,
                         std::string_view exploration, std::uint32_t repetition);

/// Time of a rest-to-rest move under a speed and an acceleration limit: trapezoid, or triangle when
/// distance < speed^2 / acceleration [s].
double move_duration_s(double distance_m, double speed_mps, double acceleration_mps2);

// Time, bytes and envelope of a plan, from the moves that the engine will command.

Forecast forecast(const Plan& plan);

/// Expected time of one trial [s], coming from `from_m` (fabric frame) at the clear height.
/// Changing the cloth by hand is not in it.
double trial_duration_s(const Plan& plan, const TrialSpec& trial, Vec2 from_m);

/// Of every trial of the plan, in order, the way to the first among it; their sum is the
/// forecast's trials_s() [s].
std::vector<double> trial_durations_s(const Plan& plan);

/// Time of phase M [s]: the probe stops at every corner.
double motion_duration_s(const Exploration& exploration, double acceleration_mps2);

}  // namespace weft::recipes
