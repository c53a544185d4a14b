// The first page: upload form and job list.

import { JobList } from "./job-list.js";
import { UploadForm } from "./upload-form.js";

const list = new JobList();
new UploadForm(() => {
  list.refresh();
  document.getElementById("jobs-heading").scrollIntoView({ behavior: "smooth", block: "nearest" });
});
