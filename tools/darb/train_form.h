// SPDX-License-Identifier: MIT
// The form of a training run, from the table of options: its fields, and what they ask for.
#pragma once

#include <string>
#include <vector>

#include "engine/core/error.h"
#include "trainer/job/request.h"
#include "viewer/train_form.h"

namespace darb {

/// Every option that a run in a window can have, those for everybody first.
std::vector<TrainField> train_fields();

/// What the form asks for. Each field whose text is not taken gets the reason, and what belongs to
/// no field is the form's error; form.has_error() then. Also fills in what is usual where that
/// follows from the rest: the output folder, the iterations.
TrainRequest judge_form(TrainForm& form);

/// Puts the error beside the field that it names, else below all of them.
void blame_field(const Error& error, TrainForm& form);
/// The reason and the hint of an error, for people who see where it belongs.
std::string complaint(const Error& error);

}  // namespace darb
