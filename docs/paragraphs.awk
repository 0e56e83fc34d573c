# Doxygen reads the headers through this. In them a comment speaks for all declarations below it up to the next blank line:
# outside of classes such a paragraph becomes a member group (its marks take the place of the blank lines around it), whose
# first comment counts for all of it. Directives and angle brackets in comments are no links and no tags.

function flush(   i, grouped) {
    grouped = count > 1 && paragraph[1] ~ /^\/\/\// && paragraph[count] !~ /^}/ && blank
    for (i = 1; i <= count; i++)
        if (paragraph[i] ~ /^(template.*)?(class|struct|enum|union|namespace) [^;]*$/) grouped = 0
    if (blank) print grouped ? "/**@{*/" : ""
    for (i = 1; i <= count; i++) print paragraph[i]
    if (grouped) printf "/**@}*/"
    count = 0
}

/\/\/\// { gsub(/#/, "\\\\#"); gsub(/ </, " \\\\<") }
/^$/ { flush(); blank = 1; next }
{ paragraph[++count] = $0 }
END { flush() }
