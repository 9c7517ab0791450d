"""Tables in Parquet files."""

from birthsim_env.registry import register
from birthsim_env.tables.table import Reading, Table, table_of


@register(reader=".parquet", about="Parquet: numbers, texts that are numbers, timestamps.", needs={"extra log"}, order=2)
def read_parquet(source: str, content: bytes, how: Reading) -> Table:
    """The table of a Parquet file."""
    from birthsim_env.tables.parquet_columns import parquet_columns  # needs the extra

    return table_of(source, parquet_columns(source, content, how))
