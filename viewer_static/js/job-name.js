// What a job is called where people see it.

/** @param {{id: string, name?: string}} job */
export const nameOfJob = (job) => job.name || `Asset ${job.id.slice(0, 8)}`;
