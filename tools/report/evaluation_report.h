// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "evaluation/evaluation.h"
#include "report/html_report.h"
#include "sdmt/eval/events.h"

namespace sdmt::tools {

/// An evaluation as one HTML page: the figures, scores by sequence, HOTA over the localisation
/// threshold, every sequence's tracks over time, and the events behind the losses. `results` says
/// in the subtitle what was scored.
std::string evaluation_html(const Evaluation& evaluation, const std::string& results,
                            const eval::EventOptions& events);

// Parts that the report of an ablation shows too.

/// MOTA, IDF1 and HOTA as groups of bars, one group for each name.
struct NamedScores {
  std::string name;
  const eval::Scores* scores = nullptr;
};
void add_score_bars(HtmlReport& report, std::span<const NamedScores> groups);

/// A row a sequence and one for all.
void add_sequence_table(HtmlReport& report, const Evaluation& evaluation);

/// A heading and the timeline of each sequence.
void add_timelines(HtmlReport& report, const Evaluation& evaluation);

}  // namespace sdmt::tools
