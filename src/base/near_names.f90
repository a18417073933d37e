!> Finds the known name that the user probably meant.
module near_names
   implicit none (type, external)
   private
   public :: nearest_name, edit_distance

contains

   !> Index of the candidate nearest to `name`, the first of equally near ones; 0 if no candidate is near enough to be a
   !> typing error (one edit for every three letters, at least one), then the shortest that begins with `name`,
   !> of at least three letters. The comparison is sensitive to case; trailing blanks do not count.
   pure integer function nearest_name(name, candidates) result(position)
      !> Name that the user wrote
      character(*), intent(in) :: name
      !> Known names, padded with blanks
      character(*), intent(in) :: candidates(:)

      ! A longer text is not compared: its table of distances would be large
      integer, parameter :: longest_name = 64
      integer :: i, distance, best

      position = 0
      if (len_trim(name) > longest_name) return
      best = max(1, len_trim(name)/3) + 1
      do i = 1, size(candidates)
         distance = edit_distance(trim(name), trim(candidates(i)))
         if (distance < best) then
            best = distance
            position = i
         end if
      end do
      if (position > 0 .or. len_trim(name) < 3) return
      best = huge(best)
      do i = 1, size(candidates)
         if (index(candidates(i), trim(name)) /= 1 .or. len_trim(candidates(i)) >= best) cycle
         best = len_trim(candidates(i))
         position = i
      end do
   end function nearest_name

   !> Minimum number of insertions, deletions, replacements and swaps of adjacent letters that turn one text into the
   !> other if no part is edited twice (the restricted Damerau-Levenshtein distance).
   pure integer function edit_distance(from, to) result(distance)
      character(*), intent(in) :: from
      character(*), intent(in) :: to

      ! Distances between the first i letters of `from` and the first j of `to`
      integer :: table(0:len(from), 0:len(to))
      integer :: i, j, replacement

      table(:, 0) = [(i, i=0, len(from))]
      table(0, :) = [(j, j=0, len(to))]
      do j = 1, len(to)
         do i = 1, len(from)
            replacement = merge(0, 1, from(i:i) == to(j:j))
            table(i, j) = min(table(i - 1, j) + 1, table(i, j - 1) + 1, table(i - 1, j - 1) + replacement)
            if (is_swap(from(:i), to(:j))) table(i, j) = min(table(i, j), table(max(0, i - 2), max(0, j - 2)) + 1)
         end do
      end do
      distance = table(len(from), len(to))
   end function edit_distance

   !> Whether two texts end with the same two letters in swapped order.
   pure logical function is_swap(from, to) result(is)
      character(*), intent(in) :: from
      character(*), intent(in) :: to

      integer :: i, j

      i = len(from)
      j = len(to)
      is = .false.
      if (min(i, j) > 1) is = from(i - 1:i) == to(j:j)//to(j - 1:j - 1)
   end function is_swap

end module near_names
