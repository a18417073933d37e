!> Lines of a spectrum, and of what harmonic of a load each is.
module spectrum_lines
   use kinds, only: pi, wp
   use load_settings, only: course_harmonic
   use number_text, only: to_text
   use run_settings, only: run_settings_t
   use sorting, only: ascending_order
   implicit none (type, external)
   private
   public :: line_t, find_lines, load_frequencies, order_in_words

   !> A line: it exceeds all within the width of the window, and this share of the strongest.
   real(wp), parameter :: least_share = 0.01_wp
   integer, parameter :: most_lines = 12
   !> A harmonic, a subharmonic or a superharmonic is a multiple of the frequency of a load over one of these.
   integer, parameter :: most_parts = 4

   type :: line_t
      !> Place among the frequencies
      integer :: place = 0
      !> Where it is greatest, over omega1, and there its amplitude: of the parabola through the logarithms of three
      real(wp) :: frequency = 0.0_wp
      real(wp) :: amplitude = 0.0_wp
      !> Multiple of the frequency of a load, over a whole number, and which load; 0: of none
      integer :: multiple = 0
      integer :: over = 1
      integer :: load = 0
   end type line_t

contains

   !> Different frequencies of the harmonic loads of a run, over omega1, ascending.
   pure function load_frequencies(settings) result(frequency)
      type(run_settings_t), intent(in) :: settings
      real(wp), allocatable :: frequency(:)

      real(wp), allocatable :: all(:)
      integer :: i

      allocate (all(0))
      if (allocated(settings%forces)) all = pack(settings%forces%course%frequency, &
         settings%forces%course%kind == course_harmonic .and. abs(settings%forces%course%amplitude) > 0.0_wp)
      if (allocated(settings%bases)) all = [all, pack(settings%bases%course%frequency, &
         settings%bases%course%kind == course_harmonic .and. abs(settings%bases%course%amplitude) > 0.0_wp)]
      all = all(ascending_order(all))
      allocate (frequency, source=pack(all, [(all(max(i - 1, 1)) < all(i) .or. i == 1, i=1, size(all))]))
   end function load_frequencies

   !> The strongest lines first.
   pure subroutine find_lines(frequency, amplitude, length, load, lines)
      !> Over omega1
      real(wp), intent(in) :: frequency(:)
      real(wp), intent(in) :: amplitude(:)
      !> Of a segment, tau
      real(wp), intent(in) :: length
      !> Frequencies of loads
      real(wp), intent(in) :: load(:)
      type(line_t), allocatable, intent(out) :: lines(:)

      integer, allocatable :: order(:), places(:)
      real(wp) :: distance, width
      integer :: i, reach

      allocate (places(0))
      distance = huge(1.0_wp)
      if (size(frequency) > 1) distance = frequency(2) - frequency(1)
      width = 2.0_wp*pi/length
      reach = max(1, int(min(2.0_wp*width/distance, real(size(frequency), wp))))
      do i = 1, size(frequency)
         if (.not. amplitude(i) > 0.0_wp .or. amplitude(i) < least_share*maxval(amplitude)) cycle
         if (any(amplitude(max(i - reach, 1):i - 1) >= amplitude(i))) cycle
         if (any(amplitude(i + 1:min(i + reach, size(frequency))) > amplitude(i))) cycle
         places = [places, i]
      end do
      order = ascending_order(-amplitude(places))
      allocate (lines(min(size(places), most_lines)))
      do i = 1, size(lines)
         lines(i)%place = places(order(i))
         call place_line(frequency, amplitude, lines(i))
         call name_line(0.5_wp*max(width, distance), load, lines(i))
      end do
   end subroutine find_lines

   !> Between the frequencies a line is higher: near its top the logarithm of what a window makes of it is a parabola.
   pure subroutine place_line(frequency, amplitude, line)
      real(wp), intent(in) :: frequency(:)
      real(wp), intent(in) :: amplitude(:)
      !> Its place is there
      type(line_t), intent(inout) :: line

      real(wp) :: curvature, shift, slope

      associate (i => line%place)
         line%frequency = frequency(i)
         line%amplitude = amplitude(i)
         if (i == 1 .or. i == size(frequency)) return
         if (.not. min(amplitude(i - 1), amplitude(i + 1)) > 0.0_wp) return
         slope = 0.5_wp*log(amplitude(i + 1)/amplitude(i - 1))
         curvature = log(amplitude(i + 1)/amplitude(i)) + log(amplitude(i - 1)/amplitude(i))
         if (.not. curvature < 0.0_wp) return
         shift = -slope/curvature
         line%frequency = frequency(i) + shift*(frequency(i + 1) - frequency(i))
         line%amplitude = amplitude(i)*exp(0.5_wp*slope*shift)
      end associate
   end subroutine place_line

   !> Of what load a line is a harmonic, as near as the spectrum tells.
   pure subroutine name_line(tolerance, load, line)
      real(wp), intent(in) :: tolerance
      real(wp), intent(in) :: load(:)
      type(line_t), intent(inout) :: line

      ! with less between them any frequency would be one
      real(wp), parameter :: least_apart = 8.0_wp
      real(wp) :: basic
      integer :: k, over

      do over = 1, most_parts
         do k = 1, size(load)
            basic = load(k)/real(over, wp)
            if (basic < least_apart*tolerance .or. line%frequency < 0.5_wp*basic) cycle
            if (abs(line%frequency - anint(line%frequency/basic)*basic) > tolerance) cycle
            line%multiple = nint(line%frequency/basic)
            line%over = over
            line%load = k
            return
         end do
      end do
   end subroutine name_line

   !> Such as '3' and '3/2', and of which load where there are several.
   pure function order_in_words(line, loads) result(words)
      type(line_t), intent(in) :: line
      integer, intent(in) :: loads
      character(:), allocatable :: words

      words = '-'
      if (line%load == 0) return
      words = to_text(line%multiple)
      if (line%over > 1) words = words//'/'//to_text(line%over)
      if (loads > 1) words = words//' of '//to_text(line%load)
   end function order_in_words

end module spectrum_lines
