!> The table of names (`impactbeam --names`) as data: what a value of each may be, read from the words of the table.
module scene_names
   use kinds, only: wp
   use scene_reference, only: list_names, reference_t
   implicit none (type, external)
   private
   public :: name_t, get_names, kind_number, kind_words, kind_logical, kind_text

   integer, parameter :: kind_number = 1
   integer, parameter :: kind_words = 2
   integer, parameter :: kind_logical = 3
   integer, parameter :: kind_text = 4

   type :: name_t
      character(24) :: group = ''
      character(48) :: name = ''
      !> One of the `kind_` constants
      integer :: kind = kind_number
      logical :: is_whole = .false.
      logical :: is_list = .false.
      !> Numbers: the ends of the range, and whether the lower one belongs to it
      real(wp) :: least = 0.0_wp
      real(wp) :: most = 0.0_wp
      logical :: excludes_least = .false.
      !> Words: how many, and which
      integer :: word_count = 0
      character(32) :: words(256) = ''
      !> Numbers: the default, if it is one
      logical :: has_default = .false.
      real(wp) :: default = 0.0_wp
      !> It stands for another name, in physical units
      logical :: is_physical = .false.
      character(32) :: instead_of = ''
   end type name_t

contains

   !> Every name.
   subroutine get_names(names)
      !> The names, group by group
      type(name_t), allocatable, intent(out) :: names(:)

      type(reference_t), allocatable :: entries(:)
      integer :: i, place

      call list_names(entries)
      allocate (names(size(entries)))
      do i = 1, size(entries)
         associate (entry => entries(i), name => names(i))
            name%group = entry%group
            ! as parameters call it
            if (any(entry%group == [character(7) :: 'support', 'mass', 'force', 'base', 'body'])) name%group = entry%group//'_1'
            name%name = entry%name
            call read_allowed(entry%allowed, name)
            if (name%kind /= kind_number) cycle
            name%has_default = .not. name%is_list .and. verify(entry%default, '0123456789.e-') == 0 .and. entry%default /= ''
            if (name%has_default) read (entry%default, *) name%default
            place = index(entry%meaning, 'instead of ')
            name%is_physical = place > 0 .and. name%most > 1.0e10_wp
            if (place == 0) cycle
            place = place + len('instead of ')
            name%instead_of = entry%meaning(place:place + index(entry%meaning(place:)//';', ';') - 2)
         end associate
      end do
   end subroutine get_names

   !> Such as 'numbers above 0, up to 1e9' and 'some of ''exact'' or ''none'''.
   subroutine read_allowed(allowed, name)
      !> What the table says
      character(*), intent(in) :: allowed
      !> Gets it
      type(name_t), intent(inout) :: name

      integer :: place, length

      if (index(allowed, 'text') == 1) then
         name%kind = kind_text
      else if (index(allowed, '.true.') == 1) then
         name%kind = kind_logical
      else if (index(allowed, '''') > 0) then
         name%kind = kind_words
         name%is_list = index(allowed, 'some of') == 1
         place = index(allowed, '''')
         do while (place > 0)
            length = index(allowed(place + 1:), '''') - 1
            name%word_count = name%word_count + 1
            name%words(name%word_count) = allowed(place + 1:place + length)
            place = place + length + 2
            if (index(allowed(place:), '''') == 0) exit
            place = place + index(allowed(place:), '''') - 1
         end do
      else
         name%is_whole = index(allowed, 'whole') == 1
         name%is_list = index(allowed, 'numbers') > 0
         name%excludes_least = index(allowed, 'above') > 0
         if (name%excludes_least) then
            place = index(allowed, 'above') + len('above')
            length = index(allowed(place:), ',') - 1
         else
            place = index(allowed, 'from') + len('from')
            length = index(allowed(place:), ' to ') - 1
         end if
         read (allowed(place:place + length - 1), *) name%least
         read (allowed(index(allowed, ' to ', back=.true.) + 4:), *) name%most
      end if
   end subroutine read_allowed

end module scene_names
