#pragma once
// A simulated campaign in parts, for many machines: each fabric is run on a fresh bench, and the
// data sets of all fabrics are merged into one.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/campaign/campaign.hpp"

namespace weft::daemon {

/// Part `number` of `count`, from 1.
struct PartNumber {
  std::size_t number = 1, count = 1;
  bool operator==(const PartNumber&) const = default;
};
/// From "2/3". Errors: invalid_argument.
Result<PartNumber> part_number_from(std::string_view text);
std::string to_string(const PartNumber& part);

/// The fabrics of a part, as indices: every count-th fabric of the recipe, from the number-th on. A
/// part may be empty.
std::vector<std::size_t> fabrics_of(const PartNumber& part, std::size_t fabrics);

/// The list of a part, beside the folders of its campaigns.
inline constexpr const char* part_file_name = "part.json";

/// The campaign on one fabric.
struct PartCampaign {
  std::string fabric;
  std::string folder;  ///< within the part's folder: "0003-denim"
  std::string dataset_sha256;
  std::size_t trials = 0;
};

struct PartSummary {
  PartNumber part;
  std::string name;
  BenchKind bench = BenchKind::unknown;
  std::vector<PartCampaign> campaigns;  ///< complete ones, in the order of the recipe
  std::size_t trials_planned = 0;
  std::optional<CampaignSummary> incomplete;  ///< the campaign that ended the part early
  bool is_promise_missed = false;             ///< of any campaign, see is_promise_missed()
  double virtual_s = 0, wall_s = 0;
};

/// The caller's callbacks during a part. Each may be left empty.
struct PartHooks {
  CampaignHooks campaign;
  /// Before each campaign; `prompts`: the number of its operator steps.
  std::function<void(const std::string& fabric, std::size_t prompts)> begins;
};

/// Runs the campaigns of a part, one after the other, in folders of `request.out`. part.json lists
/// them; it is complete when all are. With `request.resume` complete campaigns are kept. An
/// interrupted one is set aside and run again from its first trial, because a resumed one counts
/// the interrupted attempt. The trials of a fabric do not depend on the number of parts. Errors:
/// unsupported on a bench that is not simulated; wrong_state if the folder has another part, or
/// this one without `resume`; busy if another process runs it; those of run_campaign().
Result<PartSummary> run_part(const CampaignRequest& request, const PartNumber& part,
                             const PartHooks& hooks);

/// Whether the parts come from one rig, or from several rigs of a laboratory.
enum class MergeRigs {
  one,     ///< another rig file is refused
  several  ///< the rig's name becomes the group column "rig", and several rigs may have recorded
           ///< the same fabric; the first rig file is recorded
};

struct MergedDataset {
  DatasetInfo info;
  std::string sha256;
  std::size_t trials = 0;
  std::size_t datasets = 0;
};

/// Merges folders of parts, folders of campaigns and data set files of one recipe into the data set
/// `out`, in the order of the recipe's plan. The digest does not depend on the number of parts, nor
/// on the order of `inputs` unless they come from several rigs. One trial at a time is in memory.
/// Errors: not_found, naming the part or the fabric, if a trial is missing; invalid_argument if one
/// is given twice, or if recipe, rig, seed or software differ; those of DatasetReader and
/// DatasetWriter. `out` is then unchanged.
Result<MergedDataset> merge_parts(const std::vector<std::filesystem::path>& inputs,
                                  const std::filesystem::path& out, MergeRigs rigs = MergeRigs::one,
                                  const StopRequested& stop_requested = {});

}  // namespace weft::daemon
