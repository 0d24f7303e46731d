// SPDX-License-Identifier: Apache-2.0
// The declare functions of the verbs, for the verb table. A new verb needs a file, a row in the
// table and a line here.
#pragma once

#include "cmd/cli/command_line.h"

namespace peeler::cmd {

VerbAction declareRender(VerbOptions& verb);
VerbAction declareRays(VerbOptions& verb);
VerbAction declareCheck(VerbOptions& verb);
VerbAction declareBake(VerbOptions& verb);
VerbAction declareFlatten(VerbOptions& verb);
VerbAction declareExtract(VerbOptions& verb);
VerbAction declareMerge(VerbOptions& verb);
VerbAction declareHoldout(VerbOptions& verb);
VerbAction declareConvert(VerbOptions& verb);
VerbAction declareView(VerbOptions& verb);
VerbAction declareSheet(VerbOptions& verb);
VerbAction declareMasks(VerbOptions& verb);
VerbAction declareBatch(VerbOptions& verb);
VerbAction declareWorker(VerbOptions& verb);
VerbAction declareCompare(VerbOptions& verb);
VerbAction declareInfo(VerbOptions& verb);
VerbAction declareVerify(VerbOptions& verb);
VerbAction declareDevices(VerbOptions& verb);

}  // namespace peeler::cmd
