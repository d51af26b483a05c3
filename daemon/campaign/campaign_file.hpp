#pragma once
// The file of a run: made, gone on with, and concluded with data set and certificate.

#include <filesystem>

#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/resume.hpp"
#include "daemon/storage/recorder/recorder.hpp"

namespace weft::daemon {

/// A new one, with what the bench is. One that is there, with nothing on record, is set aside. What
/// was asked of the simulation is on record from the first, as not checked: whoever concludes the
/// campaign says so.
Result<Recorder> created(const std::filesystem::path& file, const SettledRequest& settled,
                         BenchSession& session);

/// The one on record, when the bench that came up is its own. Errors: same_devices()'s.
Result<Recorder> reopened(const std::filesystem::path& file, const ResumePlan& how,
                          BenchSession& session);

/// What the campaign's file says last of its simulation; empty where it says nothing.
SimulationNote simulation_on_record(const std::filesystem::path& campaign);

/// Takes away what is of an end that is none any more: the certificate, and the data set, which is
/// set aside. Errors: io.
Status forget_end(const std::filesystem::path& folder);

/// Data set and certificate of a campaign file that is finished.
Status conclude(const std::filesystem::path& folder, CampaignSummary& summary);

/// Where that could not be, or the file not be finished: what is on record is told, and why there
/// is no more. How the bench ended stays as it was.
void without_dataset(const std::filesystem::path& folder, const Error& why,
                     CampaignSummary& summary);

/// The engine knows nothing of trials that failed before it went on, nor of those that the disk
/// refused.
void fail_where_trials_lack(CampaignSummary& summary);

/// What the file says of its trials; nobody has looked at the rig.
CampaignSummary summary_on_record(const std::filesystem::path& folder,
                                  const CampaignHistory& history);

/// Of a campaign whose every trial is on record, but which was not concluded. Where that cannot be
/// now either, `dataset_error` says why.
CampaignSummary concluded(const std::filesystem::path& folder, const recipes::Plan& plan,
                          const RigFile& rig, const CampaignHistory& history);

/// Of one that came to its end before. Errors: read_certificate()'s.
Result<CampaignSummary> certified_summary(const std::filesystem::path& folder,
                                          const recipes::Plan& plan, const RigFile& rig,
                                          const CampaignHistory& history);

}  // namespace weft::daemon
