#pragma once
// The campaign file of a run: created, resumed, and concluded with data set and certificate.

#include <filesystem>

#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/resume.hpp"
#include "daemon/storage/recorder/recorder.hpp"

namespace weft::daemon {

/// Creates a campaign file with the devices of the bench. An existing file with nothing on record
/// is set aside. Records the simulation request from the start, as not checked, so that any later
/// conclusion reports it.
Result<Recorder> created(const std::filesystem::path& file, const SettledRequest& settled,
                         BenchSession& session);

/// Reopens the recorded campaign if the bench has the recorded devices. Errors: same_devices()'s
/// and Recorder::resume()'s.
Result<Recorder> reopened(const std::filesystem::path& file, const ResumePlan& how,
                          BenchSession& session);

/// The last simulation note of the campaign's file; empty if it has none.
SimulationNote simulation_on_record(const std::filesystem::path& campaign);

/// Removes the certificate of an outdated end and sets its data set aside. Errors: io.
Status forget_end(const std::filesystem::path& folder);

/// Writes data set and certificate of a finished campaign file.
Status conclude(const std::filesystem::path& folder, CampaignSummary& summary);

/// Summary if conclude() or the end of the file failed: reports the recorded trials, and `why` as
/// `dataset_error`. The other facts about the bench's end do not change.
void without_dataset(const std::filesystem::path& folder, const Error& why,
                     CampaignSummary& summary);

/// Sets the outcome to failed if complete trials are missing. The engine does not know trials that
/// failed before a resume, nor those that could not be written.
void fail_where_trials_lack(CampaignSummary& summary);

/// Summary from the trials of the file; the state of the rig is unknown.
CampaignSummary summary_on_record(const std::filesystem::path& folder,
                                  const CampaignHistory& history);

/// Concludes a campaign with every trial on record. If that fails again, `dataset_error` has the
/// reason.
CampaignSummary concluded(const std::filesystem::path& folder, const recipes::Plan& plan,
                          const RigFile& rig, const CampaignHistory& history);

/// Summary of a campaign that ended earlier. Errors: read_certificate()'s.
Result<CampaignSummary> certified_summary(const std::filesystem::path& folder,
                                          const recipes::Plan& plan, const RigFile& rig,
                                          const CampaignHistory& history);

}  // namespace weft::daemon
