"""Many motions at once: a file of jobs to a folder of shards, on one machine or a cluster, each motion exactly once.

`jobs` reads the rows, `row` resolves a row and gives it its id, `maker` generates motions of rows, `shard` writes one
shard of them into the folder (`folder`, `writers`), and `crew` (processes here) or `on_ray` (a cluster) share the
shards out. Nobody keeps a list of all rows: what is done is what lies in the folder.
"""
