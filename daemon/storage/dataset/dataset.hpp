#pragma once
// A data set in memory: the classifier's trials and, for each of them, the data that the classifier
// must not use.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "classifier/features/trial.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/text/format.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// How a trial ended. Only `complete` trials are for training. A `rejected` one ended with a bad
/// record and was repeated. The shortened slide of an `ended_early` trial (ended by a live vote)
/// differs from a complete one and is never mixed with them.
enum class TrialOutcome : std::uint8_t {
  complete,
  stopped,
  aborted,
  failed,
  interrupted,
  rejected,
  ended_early
};
/// True if the trial is as the recipe requires and need not be repeated.
bool is_done(TrialOutcome outcome);
std::string_view to_string(TrialOutcome outcome);
std::optional<TrialOutcome> trial_outcome_from(std::string_view word);

/// The part of the fabric that a trial touched, each counted from 1 within its label; 0: not known.
struct TrialPlace {
  std::uint32_t piece = 0;
  std::uint32_t mounting = 0;  ///< number of times the fabric had been mounted
  std::uint32_t patch = 0;     ///< place on the piece
  bool operator==(const TrialPlace&) const = default;
};

/// Properties of a trial known before its first sample.
struct TrialSpec {
  std::uint32_t index = 0;    ///< index in the plan, from 0
  std::uint32_t attempt = 0;  ///< 0 for the first execution, plus 1 for each repeated attempt
  std::string label;          ///< fabric
  std::string group;          ///< see classifier::Trial
  std::string exploration;    ///< "M1", "M2"; empty for imported sets
  std::uint32_t repetition = 0;
  std::uint64_t patch_seed = 0;  ///< simulated bench: seed of the touched patch
  TrialPlace place = {};
  std::vector<double> factors = {};  ///< SI, in the order of DatasetInfo::factors; empty: no sweep
  std::vector<std::string> group_values = {};  ///< in the order of DatasetInfo::group_columns
};

/// Mean normal force while the probe rests on the fabric; it should equal the probe's weight [N].
struct RestForces {
  double weight_n = 0;
  double before_n = 0, after_n = 0;  ///< phases S and E; NaN: not measured
};

/// Properties of a trial known after its last sample.
struct TrialQuality {
  std::optional<double> force_rms_error_n;  ///< phase M, relative to the set point [N]
  std::optional<double>
      force_in_band_fraction;  ///< share of phase M within the recipe's band, 0 to 1
  std::optional<RestForces> rest = {};
};

/// Wrench and stage values are stored as whole numbers of a quantum. No quantum is coarser than one
/// count of the bench's devices (ATI Net F/T at 1e6 counts per N and N m; LTS150 2.44 nm; PRM1-Z8
/// 9.1 urad). So no count is lost, files are half as large as with doubles, and digests need no
/// float format. Constants are quanta per unit because 1e6 is exact as a double and 1e-6 is not.
constexpr double force_quanta_per_n = 1e6;
constexpr double torque_quanta_per_nm = 1e6;
constexpr double position_quanta_per_m = 1e9;
constexpr double angle_quanta_per_rad = 1e8;

/// Six numbers per row (Fx Fy Fz [force quanta], Tx Ty Tz [torque quanta]), sensor frame, bias
/// removed.
struct WrenchStream {
  std::vector<std::int64_t> t_ns;    ///< [samples] host clock of the campaign
  std::vector<std::int32_t> quanta;  ///< [samples x 6]
  [[nodiscard]] std::size_t samples() const { return t_ns.size(); }
  [[nodiscard]] double force_n(std::size_t i, std::size_t axis) const;
  [[nodiscard]] double torque_nm(std::size_t i, std::size_t axis) const;
  bool operator==(const WrenchStream&) const = default;
};

/// One number per axis and row, in the order of DatasetInfo::axes.
struct StageStream {
  std::vector<std::int64_t> t_ns;    ///< [samples]
  std::vector<std::int32_t> quanta;  ///< [samples x axes]
  [[nodiscard]] std::size_t samples() const { return t_ns.size(); }
  bool operator==(const StageStream&) const = default;
};

/// Vibrations are also stored in quanta: 1 um/s2 and 1 uPa, both finer than one count of their
/// sensors.
constexpr double acceleration_quanta_per_mps2 = 1e6;
constexpr double sound_quanta_per_pa = 1e6;
constexpr std::size_t acceleration_axes = 3;

/// Readings of a fast sensor in blocks, as they arrived. Within a block they are evenly spaced by
/// the sensor's clock: reading k was taken k / rate_hz after device_us. Each block has the number
/// of readings in its BlockFormat; an acceleration reading is three numbers, x y z.
struct BlockStream {
  std::vector<std::int64_t> t_ns;  ///< [blocks] arrival on the host clock, after the last reading
  std::vector<std::uint32_t> device_us;  ///< [blocks] sensor's clock at the first reading, wraps
                                         ///< around
  std::vector<std::uint32_t> lost;       ///< [blocks] blocks missing directly before this one
  std::vector<std::uint32_t> clipped;    ///< [blocks] values at a limit of the range
  std::vector<std::int32_t> quanta;      ///< [blocks x readings x axes]
  [[nodiscard]] std::size_t blocks() const { return t_ns.size(); }
  bool operator==(const BlockStream&) const = default;
};

/// The same for all trials of a data set. `readings` is 0 if there is no such stream.
struct BlockFormat {
  double rate_hz = 0;          ///< readings per second by the sensor's clock
  std::uint32_t readings = 0;  ///< in each block
  bool operator==(const BlockFormat&) const = default;
};

/// All data of one trial that is not in classifier::Trial.
struct TrialRecord {
  TrialSpec spec;
  TrialOutcome outcome = TrialOutcome::complete;
  TrialQuality quality;
  std::uint32_t lost_samples = 0;  ///< taxel frames that never arrived
  std::vector<std::int64_t> t_ns;  ///< [samples] host clock; imported sets: the file's own times
  std::vector<std::uint32_t> device_us;  ///< [samples]; empty if the source has none
  WrenchStream wrench;                   ///< may be empty
  StageStream stages;                    ///< may be empty
  BlockStream acceleration, sound;       ///< may be empty
};

/// A stage axis; `rotary` decides the quantum (angle or position).
struct Axis {
  std::string name;  ///< "x", "y", "z", "rx", "ry"
  bool rotary = false;
  [[nodiscard]] double quanta_per_unit() const {
    return rotary ? angle_quanta_per_rad : position_quanta_per_m;
  }
  bool operator==(const Axis&) const = default;
};

/// The identification of a device. `identity_json`: serial, firmware, calibration, scale factors.
struct DeviceInfo {
  std::string name;  ///< name in the rig file
  std::string driver;
  std::string identity_json;
  bool operator==(const DeviceInfo&) const = default;
};

/// Trials with a slide that a live vote ended early. They are excluded from data sets of whole
/// slides. The remaining slides of such a fabric are those in which the vote was uncertain.
struct EndedEarly {
  std::string label;
  std::string exploration;
  std::uint32_t trials = 0;
  bool operator==(const EndedEarly&) const = default;
};

struct DatasetInfo {
  BenchKind kind = BenchKind::unknown;
  std::string name;
  std::string source;       ///< "campaign", "manifest", "fabricslide", "icub20"
  std::string recipe_json;  ///< as written, empty for imported sets
  std::string rig_json;
  std::string recipe_sha256;  ///< digest of recipe_json; Recorder::create fills it when empty
  std::string rig_sha256;
  std::uint64_t seed = 0;  ///< the seed that was used, whatever recipe_json contains
  std::string software_version;
  double taxel_rate_hz = 0;  ///< nominal; 0: not known
  double wrench_rate_hz = 0;
  double stage_rate_hz = 0;
  BlockFormat acceleration, sound;
  std::vector<Axis> axes;  ///< axes of every StageStream
  std::vector<DeviceInfo> devices;
  std::vector<std::string> factors;        ///< factors of a sweep: "force_n", "speed_mps"; usually
                                           ///< empty
  std::vector<EndedEarly> ended_early;     ///< left out; sorted by label, then exploration; usually
                                           ///< empty
  std::vector<std::string> group_columns;  ///< further named columns of an import, in byte order
  bool operator==(const DatasetInfo&) const = default;
};

/// "Selected: 12 slides that a live vote ended early are left out (denim 5, satin 7). ...", or
/// empty.
std::string format_selection(const DatasetInfo& info);

/// `trials` and `records` correspond index by index. For a rig without taxels, Trial::taxels is 0
/// and the counts are empty; Trial::phase then belongs to the wrench readings, with the times t_ns.
struct Dataset {
  DatasetInfo info;
  std::vector<classifier::Trial> trials;
  std::vector<TrialRecord> records;
  std::vector<Warning> warnings = {};  ///< from an import; not stored and in no digest
};

/// One trial of a data set with its samples.
struct TrialData {
  classifier::Trial trial;
  TrialRecord record;
};

/// Name of a recorded trial, unique within a campaign: "0007-Denim-M1-r03", with "-a1" for a second
/// attempt.
std::string trial_name(const TrialSpec& spec);

/// Copies of everything but the samples and their times.
classifier::Trial without_samples(const classifier::Trial& trial);
TrialRecord without_samples(const TrialRecord& record);

/// The first violated invariant of one trial, if any: a missing label, sizes that disagree with
/// each other or with `info`, NaN or infinity.
Status check_trial(const classifier::Trial& trial, const TrialRecord& record,
                   const DatasetInfo& info);
/// The invariants between the trials of one data set, checked one trial after the other.
class TrialSequence {
 public:
  /// Errors: a missing or repeated name; a number of taxels that differs from the first trial's.
  Status check(const classifier::Trial& trial);

 private:
  std::unordered_set<std::string> files_;
  std::optional<std::size_t> taxels_;
};
/// The first violated invariant of `dataset`, if any: sizes that disagree, two trials of the same
/// file name, NaN or infinity, mixed taxel counts. All code that writes or hashes a data set calls
/// this first.
Status check(const Dataset& dataset);

/// SHA-256 of the content (docs/reference/dataset.md, "Digest"): labels, outcomes, phases, counts,
/// times, streams and the bench kind. Wall-clock time, software version and seed are excluded.
/// Lower-case hexadecimal.
struct DatasetDigest {
  std::string dataset_sha256;
  std::vector<std::string> trial_sha256;
};
DatasetDigest compute_digest(const Dataset& dataset);
/// The same, but can be stopped: hours of recording take seconds. `stop_requested` is checked
/// before each trial. Errors: wrong_state if stopped.
Result<DatasetDigest> compute_digest(const Dataset& dataset, const StopRequested& stop_requested);
std::string dataset_sha256(const Dataset& dataset);
std::string trial_sha256(const classifier::Trial& trial, const TrialRecord& record);

/// The explorations of the complete trials, in order of appearance; one empty name for imported
/// sets.
std::vector<std::string> list_explorations(const Dataset& dataset);
/// The names in a sum of explorations: "M1" and "M2" of "M1+M2"; one empty name for an empty text.
/// Errors: invalid_argument for an empty or repeated name.
Result<std::vector<std::string>> explorations_in(std::string_view sum);
/// The complete trials of one exploration (nothing: of all), in order, as classifier input.
std::vector<classifier::Trial> complete_trials(const Dataset& dataset,
                                               std::optional<std::string_view> exploration = {});

// Copies of one recording under several names: if one copy trains, testing the other proves
// nothing.

/// Names of recordings with the same samples, in groups of two or more, ordered by their first
/// member.
using Copies = std::vector<std::vector<std::string>>;

/// Finds copies by content: `contents[i]` belongs to `names[i]`; equal text means equal samples.
Copies copies_among(const std::vector<std::string>& names,
                    const std::vector<std::string>& contents);

/// Trials with the same counts and phases, whatever their times, labels and groups. Trials with a
/// wrench only are ignored.
Copies copies_in(const Dataset& dataset);

/// One line for the user; empty without copies.
std::string copies_text(const Copies& copies);

/// The values as 16-bit counts, or nothing if one of them is not a whole number from 0 to 65535.
std::optional<std::vector<std::uint16_t>> as_u16(std::span<const double> counts);

}  // namespace weft::daemon
