#pragma once
// Pages written by commands, each drawn from the record beside it.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <span>

#include "daemon/pages/document/document.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

/// Path of a page's record: the same name with the ending .json.
std::filesystem::path record_beside(const std::filesystem::path& html);

/// Whether a page and its record may be written; called before any measurement. Checks
/// refuse_same_file() and check_output() of both. The record may only replace that of an older
/// report: the user did not name that file, and it may be a recipe. Checks nothing if `html` is
/// empty.
Status check_page(std::span<const std::filesystem::path> inputs, const std::filesystem::path& html);
Status check_page(const std::filesystem::path& input, const std::filesystem::path& html);

/// write_page(); does nothing if `html` is empty.
Status write_page_files(const std::filesystem::path& html, const nlohmann::ordered_json& record,
                        const Document& document);

/// Draws `record` again into `html`: the same bytes as the page first written beside it. Errors:
/// those of page_of_record(), io.
Status draw_record(const std::filesystem::path& record, const std::filesystem::path& html);

/// Shows a page with the desktop's program (xdg-open). Errors: not_found without that program; io
/// if it fails.
Status open_page(const std::filesystem::path& html);

}  // namespace weft::daemon::cli
